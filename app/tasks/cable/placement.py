"""Whether an obstacle overlaps the cable at the start, the connector, the sockets or the clip."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from regrasp.app.scenario.shapes import JitteredBox, half_edges, line_depth, penetration_depth
from regrasp.app.tasks.cable.cable_rest import rest_shape
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import PLUGGED_INTO, CableCell, Socket
from regrasp.interfaces.cell import pose_along
from regrasp.interfaces.fields import Vector
from regrasp.interfaces.scene import Gravity


@dataclass(frozen=True)
class CablePlacementParameters:
    """How deep an obstacle may reach into something, metres."""

    rounding: float = 1e-6  # overlap that is rounding
    taut_cable_error: float = 0.003  # by which the computed rest shape of a taut cable may be off (`rest_shape`)
    slack_cable_error: float = 0.05  # of a slack cable: it gives way, and may rest in another shape
    # Without unit: a cable is taut if its ends are farther apart than this share of its length.
    taut_share: float = 0.95


def obstacle_overlaps(
    cell: CableCell,
    box: JitteredBox,
    gravity: Gravity | None,
    parameters: CablePlacementParameters = CablePlacementParameters(),
) -> Iterator[tuple[str, float]]:
    """Name and depth (m) of each thing of the task that the box overlaps, at the place where it does so most.

    The cable hangs as at the start, and the connector is in its socket and in the clip; without a known gravity these
    are left out.
    """
    cable = cell.known.cable
    bracket = [(b.name, np.array(b.center), half_edges(np.eye(3), b.size)) for b in cable.clip.bracket]
    for name, place, halves in [*bracket, *map(socket_block, cable.sockets)]:
        depth = penetration_depth(np.vstack([box.generators, halves]), box.center - place)
        if depth > parameters.rounding:
            yield name, depth
    if gravity is None:
        return
    for name, radius, points in cable_and_connector_lines(cell, gravity):
        depth = line_depth(box.generators, box.center, points, radius)
        error = cable_error(cell, gravity, parameters) if name.startswith("the cable") else parameters.rounding
        if depth > error:
            yield name, depth


def cable_error(
    cell: CableCell, gravity: Gravity, parameters: CablePlacementParameters = CablePlacementParameters()
) -> float:
    """By how much (m) the cable may hang elsewhere than `cable_at_start` says."""
    points = cable_at_start(cell, gravity)
    way = float(np.linalg.norm(np.subtract(points[-1], points[0])))
    is_taut = way > parameters.taut_share * cell.hidden.cable.length
    return parameters.taut_cable_error if is_taut else parameters.slack_cable_error


def cable_and_connector_lines(cell: CableCell, gravity: Gravity) -> list[tuple[str, float, FloatArray]]:
    """Name, radius (m) and centre line (n, 3) m of the cable at the start, the plugged and the stowed connector."""
    known = cell.known
    ends = [[-0.5 * known.cable.connector.length, 0.0, 0.0], [0.5 * known.cable.connector.length, 0.0, 0.0]]
    plug = known.cable.socket(PLUGGED_INTO).world_from_plug(known.cable.connector.length)
    return [
        (
            f"the cable at the start ({gravity} gravity)",
            cell.hidden.cable.radius,
            np.array(cable_at_start(cell, gravity)),
        ),
        ("the plugged connector", known.cable.connector.radius, plug.apply(ends)),
        ("the stowed connector", known.cable.connector.radius, known.cable.clip.world_from_seat.apply(ends)),
    ]


@lru_cache(maxsize=16)
def cable_at_start(cell: CableCell, gravity: Gravity) -> tuple[Vector, ...]:
    """Points (m) of the cable's middle line as it hangs at the start, from its fixed end to the connector."""
    length = cell.known.cable.connector.length
    plug = cell.known.cable.socket(PLUGGED_INTO).world_from_plug(length)
    return tuple(map(tuple, rest_shape(cell.hidden.cable, plug, length, gravity).tolist()))


def socket_block(socket: Socket) -> tuple[str, FloatArray, FloatArray]:
    """Name, centre (3,) and half edges (3, 3), m, of a socket's block, which is turned towards its axis."""
    across, along, high = socket.size
    turn = pose_along(socket.center, socket.axis).rotation.as_matrix()
    return f"socket {socket.name}", np.array(socket.center), half_edges(turn, (along, across, high))
