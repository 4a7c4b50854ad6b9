"""Whether an obstacle, wherever its jitter puts it, stands in something else."""

from collections.abc import Iterator
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.app.files.findings import Finding, Findings
from regrasp.app.files.schema_nodes import at
from regrasp.app.files.validation import part
from regrasp.app.files.yaml_lines import Document, Path
from regrasp.app.scenario.cable_rest import rest_shape
from regrasp.app.scenario.sampling import LEAST_STAND, STAND
from regrasp.app.scenario.schema import Jitter, ObstacleSize, Yaw
from regrasp.interfaces.cell import PLUGGED_INTO, ArmSpec, Cell, FixedMount, KnownCell, Socket, pose_along
from regrasp.interfaces.fields import Size, Vector
from regrasp.interfaces.quote import cut, quoted
from regrasp.interfaces.scene import GRAVITIES, Gravity

FloatArray = NDArray[np.float64]
# The ViperX 300 S's base, rtb-data's mesh VXSA-300-M-1-Base: centre from the arm's base, and full size, metres.
_BASE_CENTER = np.array([-0.0475, 0.0, 0.0394])
_BASE_SIZE = (0.300, 0.204, 0.0787)
TOUCHING = 1e-6  # metres of overlap that are rounding
CABLE_ERROR = 0.003  # metres by which the computed shape of a taut cable may be off
SLACK_ERROR = 0.05  # metres, of a slack one: it gives way, and may rest in another shape
TAUT = 0.95  # share of its length that lies between the ends of a taut cable
_LIST, _TEXT, _YAW = TypeAdapter(list[Any]), TypeAdapter(str), TypeAdapter[float](Yaw)
_SIZE, _JITTER, _POINT = TypeAdapter[Size](ObstacleSize), TypeAdapter[Vector](Jitter), TypeAdapter[Vector](Vector)


def misplaced(document: Document, cell: Cell | None) -> None:
    """Raises `Findings`: obstacles that share a name, reach below the floor, or stand in the cell or in its cable.

    Of an obstacle of which some value is wrong, which is a finding elsewhere, only what the others show.
    """
    if found := list(_misplaced(document, cell)):
        raise Findings(found)


def _misplaced(document: Document, cell: Cell | None) -> Iterator[Finding]:
    obstacles = part(document, ("obstacles",), _LIST)
    seen = set()
    for i in range(len(obstacles or [])):
        here: Path = ("obstacles", i)
        name = part(document, (*here, "name"), _TEXT)
        if name is not None and name in seen:
            yield Finding(*document.place((*here, "name")), f"two obstacles {quoted(name)}; rename one")
        seen.add(name)
        who = "obstacle" + (f" {quoted(name)}" if name is not None else "")
        jitter = part(document, (*here, "jitter"), _JITTER) or (0.0, 0.0, 0.0)  # of a wrong one nobody knows
        size = part(document, (*here, "size"), _SIZE)
        yaw_deg = part(document, (*here, "yaw_deg"), _YAW, 0.0)
        for path, spot, gravity in _spots(document, here):
            place = document.place(path)
            if (deep := jitter[2] - spot[2]) > TOUCHING:
                yield Finding(*place, f"{who} reaches {deep:.3f} m below the floor; raise it to 0")
            if size is not None and yaw_deg is not None and cell is not None:
                for what, body, depth in _entered(cell, gravity, spot, size, yaw_deg, jitter):
                    message = f"{who}{what} reaches {depth:.3f} m into {cut(body)}; move it, or jitter it less"
                    yield Finding(*place, message)


def _spots(document: Document, obstacle: Path) -> Iterator[tuple[Path, Vector, Gravity | None]]:
    """Where an obstacle may stand, with the path of the value, and in which gravity; None: nobody knows in which."""
    either = (*obstacle, "position")
    if (spot := part(document, either, _POINT)) is not None:
        gravity = at(document.value, ("gravity",))
        yield either, spot, gravity if gravity in ("zero", "earth") else None  # type: ignore[misc]
    for gravity in GRAVITIES:
        if (spot := part(document, (*either, gravity), _POINT)) is not None:
            yield (*either, gravity), spot, gravity


def _entered(
    cell: Cell, gravity: Gravity | None, spot: Vector, size: Size, yaw_deg: float, jitter: Vector
) -> Iterator[tuple[str, str, float]]:
    """What of an obstacle ("" or its stand), at any place of its jitter, reaches into what, and how deep (m)."""
    bodies = [("", spot[2] + 0.5 * size[2], size)]
    if spot[2] > LEAST_STAND:
        bodies.append((" on its stand", 0.5 * spot[2], (STAND, STAND, spot[2])))
    told = set()
    for what, height, edges in bodies:
        center = np.array([*spot[:2], height])
        for body, depth in [
            *overlaps(cell.known, center, edges, yaw_deg, jitter),
            *([] if gravity is None else _in_the_cable(cell, gravity, center, edges, yaw_deg, jitter)),
        ]:
            if body not in told:
                yield what, body, depth
            told.add(body)


def _in_the_cable(
    cell: Cell, gravity: Gravity, center: FloatArray, size: Size, yaw_deg: float, jitter: Vector
) -> list[tuple[str, float]]:
    """As `overlaps`, of the cable as it hangs at the start, and of the connector in its socket and in the clip."""
    turn = Rotation.from_euler("z", yaw_deg, degrees=True).as_matrix()
    moving = np.vstack([box_halves(turn, size), np.diag(jitter)])
    found = []
    for name, radius, points in lines(cell, gravity):
        depth = line_depth(moving, center, points, radius)
        if depth > (cable_error(cell, gravity) if name.startswith("the cable") else TOUCHING):
            found.append((name, depth))
    return found


def cable_error(cell: Cell, gravity: Gravity) -> float:
    """By how much (m) the cable may hang elsewhere than `cable_at_start` says."""
    points = cable_at_start(cell, gravity)
    way = float(np.linalg.norm(np.subtract(points[-1], points[0])))
    return CABLE_ERROR if way > TAUT * cell.hidden.cable.length else SLACK_ERROR


def line_depth(generators: FloatArray, center: FloatArray, points: FloatArray, radius: float) -> float:
    """How far (m) a round line through `points` (n, 3) reaches into a box; at most 0 when apart.

    `generators` (m, 3) are the box's half edges, and those of the places of its `center` (3,), metres.
    """
    links = ((0.5 * (b - a), center - 0.5 * (a + b)) for a, b in pairwise(points))
    return radius + max(penetration(np.vstack([generators, half]), offset) for half, offset in links)


def lines(cell: Cell, gravity: Gravity) -> list[tuple[str, float, FloatArray]]:
    """Name, radius and middle line (n, 3), m, of the cable at the start, the plugged and the stowed connector."""
    known = cell.known
    ends = [[-0.5 * known.connector.length, 0.0, 0.0], [0.5 * known.connector.length, 0.0, 0.0]]
    plug = known.socket(PLUGGED_INTO).world_from_plug(known.connector.length)
    return [
        (
            f"the cable at the start ({gravity} gravity)",
            cell.hidden.cable.radius,
            np.array(cable_at_start(cell, gravity)),
        ),
        ("the plugged connector", known.connector.radius, plug.apply(ends)),
        ("the stowed connector", known.connector.radius, known.clip.world_from_seat.apply(ends)),
    ]


@lru_cache(maxsize=16)
def cable_at_start(cell: Cell, gravity: Gravity) -> tuple[Vector, ...]:
    """Points (m) of the cable's middle line as it hangs at the start, from its fixed end to the connector."""
    length = cell.known.connector.length
    plug = cell.known.socket(PLUGGED_INTO).world_from_plug(length)
    return tuple(map(tuple, rest_shape(cell.hidden.cable, plug, length, gravity).tolist()))


def overlaps(
    cell: KnownCell, center: FloatArray, size: Size, yaw_deg: float, jitter: Vector
) -> list[tuple[str, float]]:
    """Name and depth (m) of each piece of the cell that a box turned by `yaw_deg` about z may overlap.

    The box's `center` (3,) m moves by up to `jitter` on each axis; the depth is that of the worst place.
    """
    turn = Rotation.from_euler("z", yaw_deg, degrees=True).as_matrix()
    moving = np.vstack([box_halves(turn, size), np.diag(jitter)])
    found: dict[str, float] = {}
    for name, place, halves in [*_pieces(cell), *_camera_points(cell)]:
        found[name] = penetration(np.vstack([moving, halves]), center - place)
    for arm in cell.arms:
        places, halves = asleep(arm)
        depths = cube_depths(moving, center - places, halves)
        found[f"the {arm.name} arm asleep"] = float(depths.max())
    return [(name, depth) for name, depth in found.items() if depth > TOUCHING]


def penetration(generators: FloatArray, offset: FloatArray) -> float:
    """How far (m) two boxes overlap; at most 0 when apart.

    The boxes' Minkowski difference is the zonotope of all their half edges `generators` (n, 3), and the boxes overlap
    if `offset` (3,) between their centres lies inside.
    """
    normals = _facets(generators)
    reach = np.abs(generators @ normals.T).sum(axis=0)
    return float(np.min(reach - np.abs(normals @ offset)))


def cube_depths(generators: FloatArray, offsets: FloatArray, halves: FloatArray) -> FloatArray:
    """As `penetration`, of a box with each of many upright cubes: `offsets` (n, 3), half edges `halves` (n,), m."""
    normals = _facets(np.vstack([generators, np.eye(3)]))
    reach = np.abs(generators @ normals.T).sum(axis=0) + np.outer(halves, np.abs(normals).sum(axis=1))
    depths: FloatArray = np.min(reach - np.abs(offsets @ normals.T), axis=1)
    return depths


def _facets(generators: FloatArray) -> FloatArray:
    """Unit normals (m, 3) of a zonotope's facets: the cross products of pairs of its generators (n, 3)."""
    first, second = np.triu_indices(len(generators), 1)
    normals = np.cross(generators[first], generators[second])
    lengths = np.linalg.norm(normals, axis=1)
    units: FloatArray = normals[lengths > 1e-12] / lengths[lengths > 1e-12, None]
    return units


def box_halves(turn: FloatArray, size: Size) -> FloatArray:
    """Half edges (3, 3) m, a row each, of a box whose axes are the columns of `turn` (3, 3)."""
    return (turn * (0.5 * np.asarray(size))).T


def _pieces(cell: KnownCell) -> list[tuple[str, FloatArray, FloatArray]]:
    """Name, centre (3,) and half edges (3, 3) of all in the cell that rises above z = 0, so not the floor."""
    boxes = [b for b in (*cell.boxes, *cell.clip.bracket) if b.center[2] + 0.5 * b.size[2] > 0]
    pieces = [(b.name, np.array(b.center), box_halves(np.eye(3), b.size)) for b in boxes]
    return [*pieces, *map(socket_block, cell.sockets), *map(arm_base, cell.arms)]


def socket_block(socket: Socket) -> tuple[str, FloatArray, FloatArray]:
    """Name, centre (3,) and half edges (3, 3), m, of a socket's block, which is turned towards its axis."""
    across, along, high = socket.size
    turn = pose_along(socket.center, socket.axis).rotation.as_matrix()
    return f"socket {socket.name}", np.array(socket.center), box_halves(turn, (along, across, high))


def arm_base(arm: ArmSpec) -> tuple[str, FloatArray, FloatArray]:
    """As `socket_block`, of an arm's base."""
    return f"the {arm.name} arm's base", np.array(arm.base) + _BASE_CENTER, box_halves(np.eye(3), _BASE_SIZE)


def fixed_cameras(cell: KnownCell) -> list[tuple[str, FloatArray]]:
    """Names and places (3,) m of the cameras that stand still."""
    mounts = [(c.name, c.mount) for c in cell.cameras if isinstance(c.mount, FixedMount)]
    return [(name, np.array(mount.position)) for name, mount in mounts]


def _camera_points(cell: KnownCell) -> list[tuple[str, FloatArray, FloatArray]]:
    """As `_pieces`, the places of the cameras that stand still, without extent."""
    return [(f"the {name} camera", place, np.zeros((3, 3))) for name, place in fixed_cameras(cell)]


def asleep(arm: ArmSpec) -> tuple[FloatArray, FloatArray]:
    """Centres (n, 3) and half edges (n,), m, of the cubes inside the spheres that fill an arm in its sleep pose."""
    from regrasp.motion.robots.kinematics import ArmKinematics  # late: it brings the compiler
    from regrasp.motion.robots.spheres import LINKS, SPHERES

    frames = ArmKinematics(RigidTransform.from_translation(arm.base)).link_frames(np.array(arm.sleep))[LINKS]
    centers = np.einsum("nij,nj->ni", frames[:, :3, :3], SPHERES[:, :3]) + frames[:, :3, 3]
    return centers, SPHERES[:, 3] / np.sqrt(3)
