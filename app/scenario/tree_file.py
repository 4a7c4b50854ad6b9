"""Checks of a tree file by itself or for a cell; without a cell they bring neither its models nor scipy."""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.files.resources import read_text
from regrasp.app.scenario.network_file import check_networks
from regrasp.app.task import find
from regrasp.trees import check_tree
from regrasp.trees.leaf_sets import task_of

if TYPE_CHECKING:
    from regrasp.app.files.yaml_lines import Place
    from regrasp.app.task.task import Task
    from regrasp.interfaces.cell import Cell


def check_tree_file(path: Path, where: "Place | None" = None) -> None:
    """Raises `Findings` for all that is wrong in a tree file; if there is no file, at `where`, which names it.

    What a tree refers to in a cell is checked as far as every cell has it.
    """
    read_text(path, where)
    name = task_of(path)
    _check(path, names_of(None, None if name is None else find.task_named(name)), None)


def check_tree_for(path: Path, where: "Place | None", cell: "Cell | None", task: "Task | None") -> None:
    """As `check_tree_file`, for a scenario's cell and task."""
    read_text(path, where)
    _check(path, names_of(cell, task), None if task is None else task.name)


def _check(path: Path, names: Mapping[str, Collection[str]], task: str | None) -> None:
    if found := [Finding(shown(path), line, message) for line, message in check_tree(path, names=names, task=task)]:
        raise Findings(found)
    check_networks(path)


def names_of(cell: "Cell | None", task: "Task | None") -> dict[str, dict[str, str]]:
    """The names in the cell that a tree of the task may refer to, by kind, for `trees.check_tree`.

    Each has the reason why it cannot be used in this cell, or "". Without a cell: the names that every cell has.
    """
    return {} if task is None or task.cell_names is None else task.cell_names()(cell)
