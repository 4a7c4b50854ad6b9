"""The leaf classes that a tree file may name: those of every task, and the sets that packages install.

A set is an entry point of the group `regrasp.leaves`: a mapping of names to classes. One that bears the name of a task
(group `regrasp.tasks`) holds the leaves of that task; any other set is for every task. Two tasks may have leaves of one
name: a tree does one task's job.
"""

from collections.abc import Collection, Iterable, Mapping
from functools import cache
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.ports import PortsMixin

from regrasp.behaviors.common import LEAVES as COMMON
from regrasp.interfaces.plugins import PluginError, installed, load

GROUP = "regrasp.leaves"
TASKS = "regrasp.tasks"


class Leaves(dict[str, type[Any]]):
    """Leaf classes by their names in a tree file.

    `tasks` holds the task of each leaf that belongs to one, and `broken` the error of each set that could not be
    imported, by the set's name.
    """

    def __init__(
        self,
        classes: Mapping[str, type[Any]] | None = None,
        tasks: Mapping[str, str] | None = None,
        broken: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(classes or {})
        self.tasks, self.broken = dict(tasks or {}), dict(broken or {})

    def missing(self, names: Iterable[str]) -> set[str]:
        """Those of the names that no leaf has."""
        return set(names) - self.keys()


@cache
def leaf_set(name: str) -> Mapping[str, type[Any]]:
    """The leaf classes of the set of that name.

    Raises:
        PluginError: it cannot be imported.
        TypeError: it is no mapping of names to classes of leaves.
    """
    classes: Mapping[str, type[Any]] = dict(load(GROUP, name))
    for leaf, made in classes.items():
        if not (isinstance(made, type) and issubclass(made, PortsMixin) and issubclass(made, Behaviour)):
            raise TypeError(f"leaf {leaf} is no py_trees.ports.BehaviourWithPorts")
        if not (hasattr(made, "INPUT_PORTS") and hasattr(made, "OUTPUT_PORTS")):
            raise TypeError(f"leaf {leaf} has no INPUT_PORTS, or no OUTPUT_PORTS")
    return classes


@cache
def leaves_of(task: str | None) -> Leaves:
    """The leaves that a tree of this task may name: its own, and those of every task, all that there are without one.

    No other task's set is imported.
    """
    own = [task] if task in installed(GROUP) and task is not None else []
    return _gathered([*own, *sorted(installed(GROUP).keys() - installed(TASKS).keys() - {task})])


@cache
def all_leaves() -> Leaves:
    """Every leaf class. Where two sets have a leaf of one name, it is that of the first set by name."""
    return _gathered(sorted(installed(GROUP)))


def leaves_for(names: Collection[str], task: str | None = None) -> Leaves:
    """The leaves for the check of a tree file that names these: those of the task, by default of the one that they fit.

    Other tasks' leaves are among them only when the file names one that is none of these.
    """
    task = task or _task_of(names)
    own = leaves_of(task)
    if not own.missing(names):
        return own
    others = [name for name in sorted(installed(GROUP)) if name != task]
    return _gathered(others if task is None else [task, *others])


def _task_of(names: Collection[str]) -> str | None:
    """The first task whose leaves with those of every task are all that the names mean, else that of the first name."""
    rest = leaves_of(None).missing(names)
    tasks = [task for task in sorted(installed(TASKS)) if task in installed(GROUP)]
    if not rest:
        return None
    for task in tasks:
        if rest <= leaves_of(task).keys():
            return task
    return next((task for name in names if name in rest for task in tasks if name in leaves_of(task)), None)


def _gathered(sets: Iterable[str]) -> Leaves:
    """The leaves of every task and of these sets, a set before those after it."""
    found = Leaves(COMMON)
    for name in sets:
        if name not in installed(GROUP):
            continue
        try:
            classes = leaf_set(name)
        except (PluginError, TypeError, ValueError) as error:  # told where a tree names a leaf that is not found
            found.broken[name] = str(error) if isinstance(error, PluginError) else f"{type(error).__name__}: {error}"
            continue
        new = {leaf: made for leaf, made in classes.items() if leaf not in found}
        found |= new
        if name in installed(TASKS):
            found.tasks |= dict.fromkeys(new, name)
    return found
