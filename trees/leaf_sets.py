"""The installed leaves that a tree file names, and the task that they belong to."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from regrasp.interfaces.quote import cut
from regrasp.trees.element import Element, TreeSyntaxError, read_elements
from regrasp.trees.vocabulary import BUILT_IN

if TYPE_CHECKING:
    from regrasp.behaviors.registry import Leaves

_NO_LEAVES = {*BUILT_IN, "SubTree", "BehaviorTree", "root"}


def installed_leaves(root: Element, task: str | None = None) -> "Leaves":
    """The leaves among which a file is checked: those of the task, by default of the task that the file's are of.

    The sets of other tasks are imported only when the file names a leaf that is none of these.
    """
    from regrasp.behaviors.registry import leaves_for  # late: toy leaves do without it

    names = dict.fromkeys(element.tag for element in root.walk())
    return leaves_for([name for name in names if name not in _NO_LEAVES], task)


def check_task(root: Element, leaves: Mapping[str, type], task: str | None = None) -> Iterator[tuple[int, str]]:
    """A finding (line, sentence) at the first leaf of each task but `task`, by default but that of the first leaf."""
    tasks: Mapping[str, str] = getattr(leaves, "tasks", {})
    first: dict[str, Element] = {}
    for element in root.walk():
        if element.tag in tasks:
            first.setdefault(tasks[element.tag], element)
    for other, element in first.items():
        is_leaf = f"{element.label} is a leaf of the task {other}"
        if task not in (None, other):
            yield element.line, f"{is_leaf}, and the scenario's task is {task}; take leaves of {task}, or another tree"
        elif task is None and other != (own := next(iter(first))):
            there = f"{cut(first[own].tag)} of line {first[own].line} one of the task {own}"
            yield element.line, f"{is_leaf}, and {there}; a tree does one task's job: write two trees"


def not_imported(leaves: Mapping[str, type]) -> str:
    """Which leaf sets could not be imported, in words for a message about an unknown element; else nothing."""
    broken: Mapping[str, str] = getattr(leaves, "broken", {})
    return "".join(
        f", and the leaf set {cut(name)} cannot be imported ({cut(why, 200)})" for name, why in broken.items()
    )


def task_of(path: Path) -> str | None:
    """The task of a tree file's first leaf that belongs to one; None without one, and if the file cannot be read."""
    try:
        root = read_elements(path)
    except (OSError, TreeSyntaxError):  # a finding of the check
        return None
    tasks = installed_leaves(root).tasks
    return next((tasks[element.tag] for element in root.walk() if element.tag in tasks), None)
