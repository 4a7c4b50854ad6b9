"""Whether an obstacle, wherever its jitter puts it, stands in something else."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter
from scipy.spatial.transform import RigidTransform, Rotation

from app.findings import Finding, Findings
from app.scenario_schema import Jitter, ObstacleSize, Yaw
from app.schema import part
from app.yaml_lines import Document, Path
from interfaces.cell import ArmSpec, FixedMount, KnownCell, Size, Vector, pose_along
from interfaces.quote import cut, quoted

FloatArray = NDArray[np.float64]
# The ViperX 300 S's base, rtb-data's mesh VXSA-300-M-1-Base: centre from the arm's base, and full size, metres.
_BASE_CENTER = np.array([-0.0475, 0.0, 0.0394])
_BASE_SIZE = (0.300, 0.204, 0.0787)
TOUCHING = 1e-6  # metres of overlap that are rounding
_LIST, _TEXT, _YAW = TypeAdapter(list[Any]), TypeAdapter(str), TypeAdapter[float](Yaw)
_SIZE, _JITTER, _POINT = TypeAdapter[Size](ObstacleSize), TypeAdapter[Vector](Jitter), TypeAdapter[Vector](Vector)


def misplaced(document: Document, cell: KnownCell | None) -> None:
    """Raises `Findings`: obstacles that share a name, reach below the floor or stand in a piece of the cell.

    Of an obstacle of which some value is wrong, which is a finding elsewhere, only what the others show.
    """
    if found := list(_misplaced(document, cell)):
        raise Findings(found)


def _misplaced(document: Document, cell: KnownCell | None) -> Iterator[Finding]:
    obstacles = part(document, ("obstacles",), _LIST)
    seen = set()
    for i in range(len(obstacles or [])):
        here: Path = ("obstacles", i)
        name = part(document, (*here, "name"), _TEXT)
        if name is not None and name in seen:
            yield Finding(*document.place((*here, "name")), f"two obstacles {quoted(name)}; rename one")
        seen.add(name)
        size = part(document, (*here, "size"), _SIZE)
        yaw_deg = part(document, (*here, "yaw_deg"), _YAW, 0.0)
        jitter = part(document, (*here, "jitter"), _JITTER) or (0.0, 0.0, 0.0)  # of a wrong one nobody knows
        for gravity in ("zero", "earth"):
            path = (*here, "position", gravity)
            if (spot := part(document, path, _POINT)) is None:
                continue
            who = "obstacle" + (f" {quoted(name)}" if name is not None else "")
            place = document.place(path)
            if (deep := jitter[2] - spot[2]) > TOUCHING:
                yield Finding(*place, f"{who} reaches {deep:.3f} m below the floor; raise it to 0")
            if size is None or yaw_deg is None or cell is None:
                continue
            center = np.array([*spot[:2], spot[2] + 0.5 * size[2]])
            for piece, depth in overlaps(cell, center, size, yaw_deg, jitter):
                yield Finding(*place, f"{who} reaches {depth:.3f} m into {cut(piece)}; move it, or jitter it less")


def overlaps(
    cell: KnownCell, center: FloatArray, size: Size, yaw_deg: float, jitter: Vector
) -> list[tuple[str, float]]:
    """Name and depth (m) of each piece of the cell that a box turned by `yaw_deg` about z may overlap.

    The box's `center` (3,) m moves by up to `jitter` on each axis; the depth is that of the worst place.
    """
    turn = Rotation.from_euler("z", yaw_deg, degrees=True).as_matrix()
    moving = np.vstack([_halves(turn, size), np.diag(jitter)])
    found: dict[str, float] = {}
    for name, place, halves in [*_pieces(cell), *_cameras(cell)]:
        found[name] = penetration(np.vstack([moving, halves]), center - place)
    for arm in cell.arms:
        places, halves = _asleep(arm)
        depths = _cube_depths(moving, center - places, halves)
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


def _cube_depths(generators: FloatArray, offsets: FloatArray, halves: FloatArray) -> FloatArray:
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


def _halves(turn: FloatArray, size: Size) -> FloatArray:
    return (turn * (0.5 * np.asarray(size))).T


def _pieces(cell: KnownCell) -> list[tuple[str, FloatArray, FloatArray]]:
    """Name, centre (3,) and half edges (3, 3) of all in the cell that rises above z = 0, so not the floor."""
    boxes = [b for b in (*cell.boxes, *cell.clip.bracket) if b.center[2] + 0.5 * b.size[2] > 0]
    pieces = [(b.name, np.array(b.center), _halves(np.eye(3), b.size)) for b in boxes]
    for socket in cell.sockets:
        across, along, high = socket.size
        turn = pose_along(socket.center, socket.axis).rotation.as_matrix()
        pieces.append((f"socket {socket.name}", np.array(socket.center), _halves(turn, (along, across, high))))
    return pieces + [_base(arm) for arm in cell.arms]


def _base(arm: ArmSpec) -> tuple[str, FloatArray, FloatArray]:
    return f"the {arm.name} arm's base", np.array(arm.base) + _BASE_CENTER, _halves(np.eye(3), _BASE_SIZE)


def _cameras(cell: KnownCell) -> list[tuple[str, FloatArray, FloatArray]]:
    """As `_pieces`, the places of the cameras that stand still, without extent."""
    mounts = [(c.name, c.mount) for c in cell.cameras if isinstance(c.mount, FixedMount)]
    return [(f"the {name} camera", np.array(mount.position), np.zeros((3, 3))) for name, mount in mounts]


def _asleep(arm: ArmSpec) -> tuple[FloatArray, FloatArray]:
    """Centres (n, 3) and half edges (n,), m, of the cubes inside the spheres that fill an arm in its sleep pose."""
    from motion.kinematics import ArmKinematics  # late: it brings the compiler
    from motion.spheres import LINKS, SPHERES

    frames = ArmKinematics(RigidTransform.from_translation(arm.base)).link_frames(np.array(arm.sleep))[LINKS]
    centers = np.einsum("nij,nj->ni", frames[:, :3, :3], SPHERES[:, :3]) + frames[:, :3, 3]
    return centers, SPHERES[:, 3] / np.sqrt(3)
