"""Cells with a cable."""

from collections.abc import Sequence
from pathlib import Path

from regrasp.app.files.overrides import Assignment
from regrasp.app.files.resources import shipped
from regrasp.app.scenario.cell_file import load_cell
from regrasp.app.tasks.cable import TASK
from regrasp.interfaces.cable.cell import CableCell


def cable_cell(cell: str | Path, assignments: Sequence[Assignment] = (), *, laid_out: bool = True) -> CableCell:
    """A shipped cell by its name, or the one in a file by its path; `laid_out` as in `load_cell`. Raises `Findings`."""
    path = cell if isinstance(cell, Path) else shipped("cell")[cell]
    loaded = load_cell(path, assignments, task=TASK, laid_out=laid_out)
    assert isinstance(loaded, CableCell)
    return loaded
