"""The names that a tree's ports may hold in the printer task."""

from typing import get_args

from regrasp.interfaces.printer.actions import Approach, Target
from regrasp.interfaces.printer.cell import PrinterCell


def cell_names(cell: PrinterCell | None) -> dict[str, dict[str, str]]:
    """See `Task.cell_names`: the targets of the image analyzer and the approaches, in any cell."""
    return {"target": dict.fromkeys(get_args(Target), ""), "approach": dict.fromkeys(get_args(Approach), "")}
