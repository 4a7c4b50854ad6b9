"""Whether an obstacle, anywhere in its jitter, overlaps something else: boxes, arms, cameras, cable, connector."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from pydantic import TypeAdapter
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.app.files.findings import Finding, Findings
from regrasp.app.files.schema_nodes import value_at
from regrasp.app.files.validation import validated_part
from regrasp.app.files.yaml_lines import Document, Path
from regrasp.app.scenario.sampling import StandParameters
from regrasp.app.scenario.schema import Jitter, ObstacleSize, Yaw
from regrasp.app.tasks.cable.cable_rest import rest_shape
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import PLUGGED_INTO, CableCell, CableKnown, Socket
from regrasp.interfaces.cell import ArmSpec, FixedMount, pose_along
from regrasp.interfaces.fields import Size, Vector
from regrasp.interfaces.quote import cut, quoted
from regrasp.interfaces.scene import GRAVITIES, Gravity

# The ViperX 300 S's base, rtb-data's mesh VXSA-300-M-1-Base: centre from the arm's base, and full size, metres.
_BASE_CENTER = np.array([-0.0475, 0.0, 0.0394])
_BASE_SIZE = (0.300, 0.204, 0.0787)
_LIST, _TEXT, _YAW = TypeAdapter(list[Any]), TypeAdapter(str), TypeAdapter[float](Yaw)
_SIZE, _JITTER, _POINT = TypeAdapter[Size](ObstacleSize), TypeAdapter[Vector](Jitter), TypeAdapter[Vector](Vector)


@dataclass(frozen=True)
class PlacementParameters:
    """How deep an obstacle may reach into something, metres."""

    rounding: float = 1e-6  # overlap that is rounding
    taut_cable_error: float = 0.003  # by which the computed rest shape of a taut cable may be off (`rest_shape`)
    slack_cable_error: float = 0.05  # of a slack cable: it gives way, and may rest in another shape
    taut_share: float = (
        0.95  # without unit; a cable is taut if its ends are farther apart than this share of its length
    )


@dataclass(frozen=True)
class JitteredBox:
    """A box, turned by `yaw_deg` about z, whose `center` (3,) m moves by up to `jitter` m along each axis."""

    center: FloatArray
    size: Size
    yaw_deg: float = 0.0
    jitter: Vector = (0.0, 0.0, 0.0)

    @cached_property
    def generators(self) -> FloatArray:
        """Half edges (6, 3) m of the box and of the region of its centres: their zonotope is the swept volume."""
        turn = Rotation.from_euler("z", self.yaw_deg, degrees=True).as_matrix()
        return np.vstack([half_edges(turn, self.size), np.diag(self.jitter)])


def check_obstacles(
    document: Document,
    cell: CableCell | None,
    parameters: PlacementParameters = PlacementParameters(),
    stands: StandParameters = StandParameters(),  # noqa: B008 - it does not change
) -> None:
    """Raises `Findings`: obstacles that share a name, reach below the floor, or overlap the cell or its cable.

    Where a value of an obstacle is wrong, which is a finding elsewhere, the others are still checked.
    """
    if found := list(_misplaced(document, cell, parameters, stands)):
        raise Findings(found)


def _misplaced(
    document: Document, cell: CableCell | None, parameters: PlacementParameters, stands: StandParameters
) -> Iterator[Finding]:
    obstacles = validated_part(document, ("obstacles",), _LIST)
    seen = set()
    for i in range(len(obstacles or [])):
        here: Path = ("obstacles", i)
        name = validated_part(document, (*here, "name"), _TEXT)
        if name is not None and name in seen:
            yield Finding(*document.place((*here, "name")), f"two obstacles {quoted(name)}; rename one")
        seen.add(name)
        who = "obstacle" + (f" {quoted(name)}" if name is not None else "")
        jitter = validated_part(document, (*here, "jitter"), _JITTER) or (0.0, 0.0, 0.0)  # none if it is wrong
        size = validated_part(document, (*here, "size"), _SIZE)
        yaw_deg = validated_part(document, (*here, "yaw_deg"), _YAW, 0.0)
        for path, spot, gravity in _spots(document, here):
            place = document.place(path)
            if (deep := jitter[2] - spot[2]) > parameters.rounding:
                yield Finding(*place, f"{who} reaches {deep:.3f} m below the floor; raise it to 0")
            if size is not None and yaw_deg is not None and cell is not None:
                bottom = JitteredBox(np.array(spot), size, yaw_deg, jitter)
                for what, body, depth in _entered(cell, gravity, _with_stand(bottom, stands), parameters):
                    message = f"{who}{what} reaches {depth:.3f} m into {cut(body)}; move it, or jitter it less"
                    yield Finding(*place, message)


def _spots(document: Document, obstacle: Path) -> Iterator[tuple[Path, Vector, Gravity | None]]:
    """Where an obstacle may stand: the path of the value, the point, and the gravity (None: unknown) that it is for."""
    either = (*obstacle, "position")
    if (spot := validated_part(document, either, _POINT)) is not None:
        gravity = value_at(document.value, ("gravity",))
        yield either, spot, gravity if gravity in ("zero", "earth") else None  # type: ignore[misc]
    for gravity in GRAVITIES:
        if (spot := validated_part(document, (*either, gravity), _POINT)) is not None:
            yield (*either, gravity), spot, gravity


def _with_stand(piece: JitteredBox, stands: StandParameters) -> dict[str, JitteredBox]:
    """A piece, whose `center` is here that of its bottom, and its stand if it has one, by what messages call them."""
    x, y, bottom = piece.center.tolist()
    boxes = {"": replace(piece, center=np.array([x, y, bottom + 0.5 * piece.size[2]]))}
    if bottom > stands.min_height:
        post = (stands.edge, stands.edge, bottom)
        boxes[" on its stand"] = replace(piece, center=np.array([x, y, 0.5 * bottom]), size=post)
    return boxes


def _entered(
    cell: CableCell, gravity: Gravity | None, boxes: Mapping[str, JitteredBox], parameters: PlacementParameters
) -> Iterator[tuple[str, str, float]]:
    """Which of the boxes (by name) reaches into which other body, and how deep (m); each body once."""
    told = set()
    for what, box in boxes.items():
        for body, depth in [
            *overlaps(cell.known, box, parameters),
            *([] if gravity is None else _in_the_cable(cell, gravity, box, parameters)),
        ]:
            if body not in told:
                yield what, body, depth
            told.add(body)


def _in_the_cable(
    cell: CableCell, gravity: Gravity, box: JitteredBox, parameters: PlacementParameters
) -> list[tuple[str, float]]:
    """As `overlaps`, with the cable as it hangs at the start, and with the connector in its socket and in the clip."""
    found = []
    for name, radius, points in cable_and_connector_lines(cell, gravity):
        depth = line_depth(box.generators, box.center, points, radius)
        error = cable_error(cell, gravity, parameters) if name.startswith("the cable") else parameters.rounding
        if depth > error:
            found.append((name, depth))
    return found


def cable_error(cell: CableCell, gravity: Gravity, parameters: PlacementParameters = PlacementParameters()) -> float:
    """By how much (m) the cable may hang elsewhere than `cable_at_start` says."""
    points = cable_at_start(cell, gravity)
    way = float(np.linalg.norm(np.subtract(points[-1], points[0])))
    is_taut = way > parameters.taut_share * cell.hidden.cable.length
    return parameters.taut_cable_error if is_taut else parameters.slack_cable_error


def line_depth(generators: FloatArray, center: FloatArray, points: FloatArray, radius: float) -> float:
    """How far (m) a line of this `radius` (m) through `points` (n, 3) m reaches into a box; at most 0 when apart.

    `generators` (m, 3) m are half edges, of the box and of the region of its `center` (3,) m.
    """
    links = ((0.5 * (b - a), center - 0.5 * (a + b)) for a, b in pairwise(points))
    return radius + max(penetration_depth(np.vstack([generators, half]), offset) for half, offset in links)


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


def overlaps(
    cell: CableKnown, box: JitteredBox, parameters: PlacementParameters = PlacementParameters()
) -> list[tuple[str, float]]:
    """Name and depth (m) of each piece of the cell that the box overlaps, at the place where it does so most."""
    found: dict[str, float] = {}
    for name, place, halves in [*_pieces(cell), *_camera_points(cell)]:
        found[name] = penetration_depth(np.vstack([box.generators, halves]), box.center - place)
    for arm in cell.arms:
        places, halves = sleeping_arm_cubes(arm)
        depths = cube_depths(box.generators, box.center - places, halves)
        found[f"the {arm.name} arm asleep"] = float(depths.max())
    return [(name, depth) for name, depth in found.items() if depth > parameters.rounding]


def penetration_depth(generators: FloatArray, offset: FloatArray) -> float:
    r"""How far (m) two boxes overlap; at most 0 when apart.

    Two convex bodies overlap if the offset of their centres lies in their Minkowski difference. Of two boxes that is
    the zonotope of all their half edges: `generators` g_i (n, 3) m. With `offset` o (3,) m and the unit normals n of
    the zonotope's facets the depth is

    .. math:: d = \min_n \left( \sum_i |g_i \cdot n| - |o \cdot n| \right)

    (Ericson, Real-Time Collision Detection, 2005, sections 3.11 and 5.2.1).
    """
    normals = _facet_normals(generators)
    reach = np.abs(generators @ normals.T).sum(axis=0)
    return float(np.min(reach - np.abs(normals @ offset)))


def cube_depths(generators: FloatArray, offsets: FloatArray, halves: FloatArray) -> FloatArray:
    """As `penetration_depth`, for a box and each of n upright cubes: `offsets` (n, 3), half edges `halves` (n,), m."""
    normals = _facet_normals(np.vstack([generators, np.eye(3)]))
    reach = np.abs(generators @ normals.T).sum(axis=0) + np.outer(halves, np.abs(normals).sum(axis=1))
    depths: FloatArray = np.min(reach - np.abs(offsets @ normals.T), axis=1)
    return depths


def _facet_normals(generators: FloatArray) -> FloatArray:
    """Unit normals (m, 3) of a zonotope's facets: the cross products of pairs of its generators (n, 3)."""
    first, second = np.triu_indices(len(generators), 1)
    normals = np.cross(generators[first], generators[second])
    lengths = np.linalg.norm(normals, axis=1)
    units: FloatArray = normals[lengths > 1e-12] / lengths[lengths > 1e-12, None]
    return units


def half_edges(turn: FloatArray, size: Size) -> FloatArray:
    """Half edges (3, 3) m, one per row, of a box of `size` m whose axes are the columns of `turn` (3, 3)."""
    return (turn * (0.5 * np.asarray(size))).T


def _pieces(cell: CableKnown) -> list[tuple[str, FloatArray, FloatArray]]:
    """Name, centre (3,) m and half edges (3, 3) m of all in the cell that rises above z = 0: not of the floor."""
    boxes = [b for b in (*cell.boxes, *cell.clip.bracket) if b.center[2] + 0.5 * b.size[2] > 0]
    pieces = [(b.name, np.array(b.center), half_edges(np.eye(3), b.size)) for b in boxes]
    return [*pieces, *map(socket_block, cell.sockets), *map(arm_base, cell.arms)]


def socket_block(socket: Socket) -> tuple[str, FloatArray, FloatArray]:
    """Name, centre (3,) and half edges (3, 3), m, of a socket's block, which is turned towards its axis."""
    across, along, high = socket.size
    turn = pose_along(socket.center, socket.axis).rotation.as_matrix()
    return f"socket {socket.name}", np.array(socket.center), half_edges(turn, (along, across, high))


def arm_base(arm: ArmSpec) -> tuple[str, FloatArray, FloatArray]:
    """As `socket_block`, of an arm's base."""
    return f"the {arm.name} arm's base", np.array(arm.base) + _BASE_CENTER, half_edges(np.eye(3), _BASE_SIZE)


def fixed_cameras(cell: CableKnown) -> list[tuple[str, FloatArray]]:
    """Names and positions (3,) m of the fixed cameras."""
    mounts = [(c.name, c.mount) for c in cell.cameras if isinstance(c.mount, FixedMount)]
    return [(name, np.array(mount.position)) for name, mount in mounts]


def _camera_points(cell: CableKnown) -> list[tuple[str, FloatArray, FloatArray]]:
    """As `_pieces`, for the fixed cameras: points."""
    return [(f"the {name} camera", place, np.zeros((3, 3))) for name, place in fixed_cameras(cell)]


def sleeping_arm_cubes(arm: ArmSpec) -> tuple[FloatArray, FloatArray]:
    """Centres (n, 3) and half edges (n,), m, of the cubes inside the spheres that fill an arm in its sleep pose."""
    from regrasp.motion.robots.kinematics import ArmKinematics  # late: it brings the compiler
    from regrasp.motion.robots.spheres import SPHERE_LINKS, SPHERES

    frames = ArmKinematics(RigidTransform.from_translation(arm.base)).link_frames(np.array(arm.sleep))[SPHERE_LINKS]
    centers = np.einsum("nij,nj->ni", frames[:, :3, :3], SPHERES[:, :3]) + frames[:, :3, 3]
    return centers, SPHERES[:, 3] / np.sqrt(3)
