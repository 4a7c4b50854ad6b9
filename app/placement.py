"""Whether an obstacle, wherever its jitter puts it, stands in something else."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from interfaces.cell import ArmSpec, KnownCell, Size, Vector, pose_along

FloatArray = NDArray[np.float64]
# The ViperX 300 S's base, rtb-data's mesh VXSA-300-M-1-Base: centre from the arm's base, and full size, metres.
_BASE_CENTER = np.array([-0.0475, 0.0, 0.0394])
_BASE_SIZE = (0.300, 0.204, 0.0787)
TOUCHING = 1e-6  # metres of overlap that are rounding


def overlaps(
    cell: KnownCell, center: FloatArray, size: Size, yaw_deg: float, jitter: Vector
) -> list[tuple[str, float]]:
    """Name and depth (m) of each piece of the cell that a box turned by `yaw_deg` about z may overlap.

    The box's `center` (3,) m moves by up to `jitter` on each axis; the depth is that of the worst place.
    """
    turn = Rotation.from_euler("z", yaw_deg, degrees=True).as_matrix()
    moving = np.vstack([_halves(turn, size), np.diag(jitter)])
    found = []
    for name, place, halves in _pieces(cell):
        depth = penetration(np.vstack([moving, halves]), center - place)
        if depth > TOUCHING:
            found.append((name, depth))
    return found


def penetration(generators: FloatArray, offset: FloatArray) -> float:
    """How far (m) two boxes overlap; at most 0 when apart.

    The boxes' Minkowski difference is the zonotope of all their half edges `generators` (n, 3): its facets' normals are
    the cross products of pairs of them, and the boxes overlap if `offset` (3,) between their centres lies inside.
    """
    first, second = np.triu_indices(len(generators), 1)
    normals = np.cross(generators[first], generators[second])
    lengths = np.linalg.norm(normals, axis=1)
    normals = normals[lengths > 1e-12] / lengths[lengths > 1e-12, None]
    reach = np.abs(generators @ normals.T).sum(axis=0)
    return float(np.min(reach - np.abs(normals @ offset)))


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
