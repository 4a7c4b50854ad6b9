"""Words in a scenario that belong to another task: its expectations and its faults."""

from typing import TYPE_CHECKING

from regrasp.app.files.findings import Findings
from regrasp.app.files.schema_nodes import value_at
from regrasp.app.files.yaml_lines import Document, Path
from regrasp.app.scenario.schema import fault_types
from regrasp.app.task import find
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.quote import nearest, quoted

if TYPE_CHECKING:
    from regrasp.app.task.task import Task


def words_of_others(document: Document, task: "Task") -> dict[Path, str]:
    """A message for each expectation and fault that the task does not have and another has, by its path."""
    told: dict[Path, str] = {}
    others = [other for other in find.tasks() if other is not task and _is_whole(other)]
    own = [*task.expect().model_fields]
    expect = value_at(document.value, ("expect",))
    for key in expect if isinstance(expect, dict) else ():
        owners = [other.name for other in others if key in other.expect().model_fields]
        if key not in own and owners:
            message = f"expect.{key} is judged by the task {owners[0]}, and this scenario's is {task.name}"
            told["expect", key] = f"{message}; {nearest(key, own)}"
    cause = value_at(document.value, ("expect", "cause"))
    owners = [other.name for other in others if cause in list(other.causes())]
    if isinstance(cause, str) and owners and cause not in [*CauseCode, *task.causes()]:
        told["expect", "cause"] = (
            f"expect.cause: {quoted(cause)} is a cause of the task {owners[0]}, and this scenario's is {task.name}"
        )
    faults, known = value_at(document.value, ("faults",)), [*fault_types(task)]
    for i in range(len(faults) if isinstance(faults, list) else 0):
        kind, when = value_at(faults, (i, "type")), value_at(faults, (i, "when"))
        for key in when if isinstance(when, dict) else ():
            owners = [other.name for other in others if key in other.when().model_fields]
            if key not in task.when().model_fields and owners:
                message = f"faults.{i}.when.{key} is of the task {owners[0]}, and this scenario's is {task.name}"
                told["faults", i, "when", key] = f"{message}; {nearest(key, [*task.when().model_fields])}"
        owners = [other.name for other in others if isinstance(kind, str) and kind in fault_types(other)]
        if isinstance(kind, str) and kind not in known and owners:
            message = f"{quoted(kind)} is a fault of the task {owners[0]}, and this scenario's is {task.name}"
            told["faults", i] = told["faults", i, "type"] = f"faults.{i}.type: {message}; {nearest(kind, known)}"
    return told


def _is_whole(task: "Task") -> bool:
    """Whether the task's words can be loaded."""
    try:
        task.expect(), task.causes(), task.when(), task.faults()
    except Findings:
        return False
    return True
