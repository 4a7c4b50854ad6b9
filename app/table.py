"""A table on stdout."""

import sys
from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text


def print_table(header: Sequence[str], lines: Sequence[Sequence[str]]) -> None:
    """Drawn on a terminal, plain aligned columns in a pipe; the first column to the left."""
    if sys.stdout.isatty():
        drawn = Table(*header)
        for column in drawn.columns[1:]:
            column.justify = "right"
        for line in lines:
            drawn.add_row(*map(Text, line))  # brackets in a name are no markup
        Console().print(drawn)
        return
    widths = [max(len(line[i]) for line in (header, *lines)) for i in range(len(header))]
    for line in (header, *lines):
        cells = [cell.rjust(width) for cell, width in zip(line[1:], widths[1:], strict=True)]
        print("  ".join([line[0].ljust(widths[0]), *cells]))
