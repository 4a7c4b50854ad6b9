"""Where the wrist camera goes to look for the connector: the thesis's spiral (Hwang 2024, section 3.4.3)."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cell import OPTICAL
from regrasp.interfaces.frame import Intrinsics
from regrasp.motion.robots.kinematics import FloatArray

SPACING = 0.25  # metres between main points
SUB_SPACING = 0.125
TURN = np.pi / 6  # of a subpoint's view towards its main point
DISTANCE = 0.30  # metres from the plane through the start; the thesis leaves it out
_RINGS = 8  # 2 m: more than the rear camera sees
CLOSE_DISTANCES = (0.30, 0.24, 0.36)  # metres of a closer look: the wrist camera has no depth under 0.18
_ROUND = ((1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1))  # right first, then downwards
_RIGHT = np.array([0.0, -1.0, 0.0])  # as seen when looking at the back panel
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Stop:
    """One place to look from: `index` counts stops, `main` main points; `sub` is 0 for the flat view, then 1-8."""

    index: int
    main: int
    sub: int
    world_from_camera: RigidTransform


def spiral(
    start: FloatArray, world_from_rear: RigidTransform, rear: Intrinsics, distance: float = DISTANCE
) -> Iterator[Stop]:
    """Stops of the search from `start` (3,) in world outwards, in the plane through it parallel to the back panel.

    Every main point is viewed flat (along world x) from `distance` metres, then from eight subpoints round it. Main
    points out of the rear camera's view are left out and do not count.
    """
    main = 0
    for across, up in _square_spiral():
        point = np.asarray(start, float) + SPACING * (across * _RIGHT + up * _UP)
        if not _in_view(point, world_from_rear, rear):
            continue
        for sub, (i, j) in enumerate(((0, 0), *_ROUND)):
            yield Stop(9 * main + sub, main, sub, _view(point, distance, SUB_SPACING * (i * _RIGHT + j * _UP)))
        main += 1


def _square_spiral() -> Iterator[tuple[int, int]]:
    """Steps (right, up) of a square spiral from (0, 0): right, down, left, up, ever longer."""
    across, up, length = 0, 0, 1
    yield across, up
    for turn, (dx, dy) in enumerate([(1, 0), (0, -1), (-1, 0), (0, 1)] * _RINGS):
        for _ in range(length):
            across, up = across + dx, up + dy
            yield across, up
        length += turn % 2


def _view(point: FloatArray, distance: float, offset: FloatArray) -> RigidTransform:
    """world_from_camera at `offset` (3,) from the main point's flat view, turned towards the main point."""
    position = point + offset - np.array([distance, 0.0, 0.0])
    inwards = -offset / max(float(np.linalg.norm(offset)), 1e-9)
    turn = Rotation.from_rotvec(TURN * np.cross([1.0, 0.0, 0.0], inwards))
    return RigidTransform.from_components(position, turn * OPTICAL)


def _in_view(point: FloatArray, world_from_camera: RigidTransform, camera: Intrinsics) -> bool:
    x, y, z = world_from_camera.inv().apply(point)
    if z <= 0:
        return False
    u, v = camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy
    return bool(-0.5 <= u < camera.width - 0.5 and -0.5 <= v < camera.height - 0.5)


def closer_views(world_from_connector: RigidTransform) -> list[RigidTransform]:
    """Places to look closely at a connector that was seen: world_from_camera, the best first.

    From the arms' side (towards -x), as square to its axis as may be: there its whole length shows, and its tilt in
    depth.
    """
    center = world_from_connector.translation
    axis = world_from_connector.rotation.apply([1.0, 0.0, 0.0])
    views = []
    for distance in CLOSE_DISTANCES:
        for yaw in np.deg2rad(np.arange(-75.0, 76.0, 15.0)):
            for pitch in np.deg2rad(np.arange(-15.0, 76.0, 15.0)):
                # ZY: first down by the pitch, then left by the yaw
                turn = Rotation.from_euler("ZY", [yaw, pitch])
                sight = turn.apply([1.0, 0.0, 0.0])
                cost = abs(float(sight @ axis)) + 0.2 * abs(distance - CLOSE_DISTANCES[0])
                views.append((cost, RigidTransform.from_components(center - distance * sight, turn * OPTICAL)))
    return [pose for _, pose in sorted(views, key=lambda view: view[0])]
