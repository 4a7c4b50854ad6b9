"""The tasks that are installed: the entry points of the group `regrasp.tasks`."""

from collections.abc import Iterator
from functools import cache
from typing import TYPE_CHECKING

from regrasp.app.files.findings import Finding, Findings
from regrasp.interfaces.plugins import PluginError, installed, load
from regrasp.interfaces.quote import nearest, quoted

if TYPE_CHECKING:
    from regrasp.app.files.yaml_lines import Place
    from regrasp.app.task.task import Task
    from regrasp.app.task.words import Words

GROUP = "regrasp.tasks"


def names() -> list[str]:
    """The names of all tasks; none is imported."""
    return [*installed(GROUP)]


def task_named(name: str, where: "Place | None" = None) -> "Task":
    """The task of that name.

    Raises `Findings`, which stand at `where`, if there is none or it cannot be loaded.
    """
    place = where or ("task", 0)
    if name not in installed(GROUP):
        raise Findings([Finding(*place, f"no task {quoted(name)}; {nearest(name, names())}")])
    task = _loaded(name)
    if isinstance(task, str):
        raise Findings([Finding(*place, f"the task {name} cannot be loaded: {task}")])
    return task


@cache
def _loaded(name: str) -> "Task | str":
    """The task, or why it cannot be loaded."""
    from regrasp.app.task.task import Task

    try:
        task = load(GROUP, name)
    except PluginError as error:
        return f"{error}; mend its package, or remove it"
    if not isinstance(task, Task):
        return f"it is {type(task).__name__}, not a regrasp.app.task.task.Task; mend its package"
    if task.name != name:
        return f"its entry point is named {name}, and itself {task.name!r}; give both one name"
    return task


def words_of(task: str) -> "Words":
    """The words of the task of that name; those of every task if it is not installed."""
    from regrasp.app.task.words import PLAIN

    try:
        return task_named(task).words()
    except Findings:  # the task is gone or broken: its values are told by their names
        return PLAIN


def of_old_records() -> str:
    """The task of records from before there were several: the one that has words of that time."""
    return next((task.name for task in tasks() if task.old_outcomes), "")


def old_outcomes() -> dict[str, str]:
    """The outcomes of schema 1, of all tasks, and what is written today."""
    return {old: new for task in tasks() for old, new in task.old_outcomes.items()}


def old_cell_keys() -> dict[str, str]:
    """The keys of cell files from before there were sections, of all tasks, and where they are today."""
    return {old: new for task in tasks() for old, new in task.old_cell_keys.items()}


def tasks() -> Iterator["Task"]:
    """All tasks that can be loaded."""
    for name in names():
        try:
            yield task_named(name)
        except Findings:
            continue
