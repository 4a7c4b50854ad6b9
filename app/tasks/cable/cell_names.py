"""The names in a cell that a tree of the cable task may refer to."""

from typing import TYPE_CHECKING

from regrasp.interfaces.quote import quoted
from regrasp.perception.pose.technique import TECHNIQUES

if TYPE_CHECKING:
    from regrasp.interfaces.cable.cell import CableCell


def cell_names(cell: "CableCell | None") -> dict[str, dict[str, str]]:
    """The names by kind, each with the reason why it cannot be used in this cell, or "".

    Without a cell: the names that every cell has.
    """
    techniques: dict[str, str] = dict.fromkeys(TECHNIQUES, "")
    if cell is None:
        return {"technique": techniques}
    from regrasp.interfaces.cable.cell import PLUGGED_INTO  # late: it brings scipy

    cable = cell.known.cable
    if cable.connector.tag is None:
        techniques["fiducial"] = "needs a tag on the connector, and this cell's has none; take the cell thesis_tags"
    plugged = cable.plugged_into
    empty = f"is empty at the start: the cell's plugged_into is {quoted(plugged)}; write {PLUGGED_INTO}"
    sockets = {socket.name: "" if socket.name == plugged else empty for socket in cable.sockets}
    free = {socket.name: "" for socket in cable.sockets} | {cable.sockets[-1].name: "holds the cable's other end"}
    return {"socket": {PLUGGED_INTO: ""} | sockets, "free_socket": {PLUGGED_INTO: ""} | free, "technique": techniques}
