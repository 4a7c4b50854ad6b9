"""A table on stdout."""

import sys
from collections.abc import Sequence

from rich.cells import cell_len
from rich.console import Console
from rich.table import Table
from rich.text import Text

NARROW = 16  # columns of the terminal to which the first column may be folded


def print_table(header: Sequence[str], lines: Sequence[Sequence[str]]) -> None:
    """Drawn on a terminal, plain aligned columns in a pipe; the first column to the left.

    On a narrow terminal the first column is folded, and then those at the right are left out; nothing is cut.
    """
    widths = [max(cell_len(line[i]) for line in (header, *lines)) for i in range(len(header))]
    if sys.stdout.isatty():
        _draw(header, lines, widths)
        return
    for line in (header, *lines):
        cells = [cell.rjust(width) for cell, width in zip(line[1:], widths[1:], strict=True)]
        print("  ".join([line[0].ljust(widths[0]), *cells]))


def _draw(header: Sequence[str], lines: Sequence[Sequence[str]], widths: Sequence[int]) -> None:
    console = Console()
    room = console.width - min(widths[0], NARROW) - 4  # 3 for the lines round a column, and one more for the first
    shown = 1
    while shown < len(widths) and (room := room - widths[shown] - 3) >= 0:
        shown += 1
    drawn = Table()
    drawn.add_column(header[0], overflow="fold")
    for title in header[1:shown]:
        drawn.add_column(title, justify="right", no_wrap=True)
    for line in lines:
        drawn.add_row(*map(Text, line[:shown]))  # brackets in a name are no markup
    console.print(drawn)
