"""Words in a scenario that belong to another task: its expectations and its faults."""

from typing import TYPE_CHECKING

from regrasp.app.files.schema_nodes import value_at
from regrasp.app.files.yaml_lines import Document, Path
from regrasp.app.scenario.schema import fault_types
from regrasp.app.task import find
from regrasp.interfaces.quote import nearest, quoted

if TYPE_CHECKING:
    from regrasp.app.task.task import Task


def words_of_others(document: Document, task: "Task") -> dict[Path, str]:
    """A message for each expectation and fault that the task does not have and another has, by its path."""
    told: dict[Path, str] = {}
    others = [other for other in find.tasks() if other is not task]
    own = [*task.expect().model_fields]
    expect = value_at(document.value, ("expect",))
    for key in expect if isinstance(expect, dict) else ():
        owners = [other.name for other in others if key in other.expect().model_fields]
        if key not in own and owners:
            message = f"expect.{key} is judged by the task {owners[0]}, and this scenario's is {task.name}"
            told["expect", key] = f"{message}; {nearest(key, own)}"
    faults, known = value_at(document.value, ("faults",)), [*fault_types(task)]
    for i in range(len(faults) if isinstance(faults, list) else 0):
        kind = value_at(faults, (i, "type"))
        owners = [other.name for other in others if isinstance(kind, str) and kind in fault_types(other)]
        if isinstance(kind, str) and kind not in known and owners:
            message = f"{quoted(kind)} is a fault of the task {owners[0]}, and this scenario's is {task.name}"
            told["faults", i] = told["faults", i, "type"] = f"faults.{i}.type: {message}; {nearest(kind, known)}"
    return told
