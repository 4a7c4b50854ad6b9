"""Checks of a tree file by itself or for a cell; without a cell they bring neither its models nor scipy."""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.files.resources import read_text
from regrasp.interfaces.quote import quoted
from regrasp.perception.pose.technique import TECHNIQUES
from regrasp.trees import check_tree

if TYPE_CHECKING:
    from regrasp.app.files.yaml_lines import Place
    from regrasp.interfaces.cable.cell import CableCell


def check_tree_file(
    path: Path, where: "Place | None" = None, names: Mapping[str, Collection[str]] | None = None
) -> None:
    """Raises `Findings` for all that is wrong in a tree file; if there is no file, at `where`, which names it.

    `names` are the names in the cell, by kind; without them the tree's references to the cell are not checked.
    """
    read_text(path, where)
    found = [Finding(shown(path), line, message) for line, message in check_tree(path, names=names)]
    if found:
        raise Findings(found)


def names_of(cell: "CableCell | None") -> dict[str, dict[str, str]]:
    """The names in the cell that a tree may refer to, by kind, for `trees.check_tree`.

    Each has the reason why it cannot be used in this cell, or "". Without a cell: the names that every cell has.
    """
    techniques: dict[str, str] = dict.fromkeys(TECHNIQUES, "")
    if cell is None:
        return {"technique": techniques}
    from regrasp.interfaces.cable.cell import PLUGGED_INTO

    if cell.known.cable.connector.tag is None:
        techniques["fiducial"] = "needs a tag on the connector, and this cell's has none; take the cell thesis_tags"
    plugged = cell.known.cable.plugged_into
    empty = f"is empty at the start: the cell's plugged_into is {quoted(plugged)}; write {PLUGGED_INTO}"
    sockets = {socket.name: "" if socket.name == plugged else empty for socket in cell.known.cable.sockets}
    return {"socket": {PLUGGED_INTO: ""} | sockets, "technique": techniques}
