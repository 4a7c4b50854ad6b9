"""Prints a table to stdout."""

import sys
from collections.abc import Sequence

from rich.cells import cell_len
from rich.console import Console
from rich.table import Table
from rich.text import Text


def print_table(header: Sequence[str], lines: Sequence[Sequence[str]], min_first_width: int = 16) -> None:
    """A table with lines on a terminal, plain aligned columns in a pipe; the first column is left-aligned.

    On a narrow terminal the first column is folded, down to `min_first_width` characters; then columns at the right are
    left out. No text is cut.
    """
    widths = [max(cell_len(line[i]) for line in (header, *lines)) for i in range(len(header))]
    if sys.stdout.isatty():
        _draw_table(header, lines, widths, min_first_width)
        return
    for line in (header, *lines):
        cells = [cell.rjust(width) for cell, width in zip(line[1:], widths[1:], strict=True)]
        print("  ".join([line[0].ljust(widths[0]), *cells]))


def _draw_table(
    header: Sequence[str], lines: Sequence[Sequence[str]], widths: Sequence[int], min_first_width: int
) -> None:
    console = Console()
    # Each column has 3 characters around it, the first has 4.
    room = console.width - min(widths[0], min_first_width) - 4
    shown = 1
    while shown < len(widths) and (room := room - widths[shown] - 3) >= 0:
        shown += 1
    table = Table()
    table.add_column(header[0], overflow="fold")
    for title in header[1:shown]:
        table.add_column(title, justify="right", no_wrap=True)
    for line in lines:
        table.add_row(*map(Text, line[:shown]))  # Text: brackets in a name are no markup
    console.print(table)
