"""Checks of a tree file by itself or for a cell; without a cell they bring neither its models nor scipy."""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.files.resources import read_text
from regrasp.app.task import find
from regrasp.trees import check_tree

if TYPE_CHECKING:
    from regrasp.app.files.yaml_lines import Place
    from regrasp.app.task.task import Task
    from regrasp.interfaces.cell import Cell


def check_tree_file(
    path: Path,
    where: "Place | None" = None,
    names: Mapping[str, Collection[str]] | None = None,
    task: str | None = None,
) -> None:
    """Raises `Findings` for all that is wrong in a tree file; if there is no file, at `where`, which names it.

    `names` are the names in the cell, by kind; without them the tree's references to the cell are not checked. With a
    `task` its leaves, and those of every task, are known.
    """
    read_text(path, where)
    found = [Finding(shown(path), line, message) for line, message in check_tree(path, names=names, task=task)]
    if found:
        raise Findings(found)


def names_of(cell: "Cell | None", task: "Task | None" = None) -> dict[str, dict[str, str]]:
    """The names in the cell that a tree of the task may refer to, by kind, for `trees.check_tree`.

    Each has the reason why it cannot be used in this cell, or "". Without a cell: the names that every cell has.
    Without a task: those of all tasks.
    """
    chosen = find.tasks() if task is None else [task]
    return {
        kind: names for one in chosen if one.cell_names is not None for kind, names in one.cell_names()(cell).items()
    }
