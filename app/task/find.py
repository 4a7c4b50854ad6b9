"""The tasks that are installed: the entry points of the group `regrasp.tasks`."""

from collections.abc import Iterator
from functools import cache
from typing import TYPE_CHECKING

from regrasp.app.files.findings import Finding, Findings
from regrasp.interfaces.plugins import installed, load
from regrasp.interfaces.quote import nearest, quoted

if TYPE_CHECKING:
    from regrasp.app.files.yaml_lines import Place
    from regrasp.app.task.task import Task

GROUP = "regrasp.tasks"


def names() -> list[str]:
    """The names of all tasks; none is imported."""
    return sorted(installed(GROUP))


@cache
def task_named(name: str, where: "Place | None" = None) -> "Task":
    """The task of that name.

    Raises `Findings`, which stand at `where`, if there is none or it cannot be imported.
    """
    place = where or ("task", 0)
    if name not in installed(GROUP):
        raise Findings([Finding(*place, f"no task {quoted(name)}; {nearest(name, names())}")])
    try:
        task: Task = load(GROUP, name)
    except Exception as error:
        message = f"the task {name} cannot be loaded: {type(error).__name__}: {error}; mend its package, or remove it"
        raise Findings([Finding(*place, message)]) from error
    return task


def tasks() -> Iterator["Task"]:
    """All tasks that can be imported."""
    for name in names():
        try:
            yield task_named(name)
        except Findings:
            continue
