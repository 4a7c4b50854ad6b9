"""Reads a cell that must have a printer."""

from pathlib import Path

from regrasp.app.files.findings import Finding, Findings
from regrasp.app.files.resources import resolve
from regrasp.app.scenario.cell_file import load_cell
from regrasp.interfaces.printer.cell import PrinterCell
from regrasp.interfaces.quote import quoted


def printer_cell(name: str) -> PrinterCell:
    """The cell of a name or a path. Raises `Findings` if it is none, or has no printer."""
    read = load_cell(resolve("cell", name, Path()))
    if not isinstance(read, PrinterCell):
        raise Findings([Finding("--cell", 0, f"{quoted(name)} has no printer; name a cell that has one")])
    return read
