"""The names that a tree's ports may hold in the printer task."""

from typing import get_args

from regrasp.interfaces.printer.actions import Approach, Free, Place, Target
from regrasp.interfaces.printer.cell import PrinterCell


def cell_names(cell: PrinterCell | None) -> dict[str, dict[str, str]]:
    """See `Task.cell_names`: in any cell the image analyzer's targets, the approaches, and what leaves' ports name."""
    kinds = {"target": Target, "approach": Approach, "free": Free, "place": Place}
    return {kind: dict.fromkeys(get_args(names), "") for kind, names in kinds.items()}
