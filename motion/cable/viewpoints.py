"""Viewpoints of the camera on an arm for the search and for a closer look.

The search is the thesis's spiral (Hwang 2024, section 3.4.3).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.motion import Viewpoint as Viewpoint
from regrasp.interfaces.frame import Intrinsics

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform

# Steps (right, up) from a main point to its subpoints: the right one first, then downwards and round.
_SUBPOINTS = ((1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1))
_RIGHT = np.array([0.0, -1.0, 0.0])  # as seen when looking at the back panel
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class SpiralParameters:
    """The spiral's size; the thesis's values where nothing else is said."""

    spacing: float = 0.25  # m between main points
    sub_spacing: float = 0.125  # m from a main point to its subpoints, across and up
    view_turn: float = np.pi / 6  # rad by which a subpoint's view turns towards its main point
    distance: float = 0.30  # m from the plane through the start; choice: the thesis leaves it out
    rings: int = 8  # choice: 2 m, more than the overview camera sees


@dataclass(frozen=True)
class CloseViewParameters:
    """The places of a closer look."""

    distances: tuple[float, ...] = (0.30, 0.24, 0.36)  # m, the preferred first; under 0.18 the camera has no depth
    yaws_deg: tuple[float, ...] = tuple(np.arange(-75.0, 76.0, 15.0).tolist())  # to the left of world x
    pitches_deg: tuple[float, ...] = tuple(np.arange(-15.0, 76.0, 15.0).tolist())  # downwards
    distance_cost: float = 0.2  # 1/m off the preferred distance, against the cosine of the angle to the axis; choice


def spiral(
    start: FloatArray,
    world_from_overview: "RigidTransform",
    overview: Intrinsics,
    parameters: SpiralParameters = SpiralParameters(),
) -> Iterator[Viewpoint]:
    """Viewpoints of the search from `start` (3,) m in the world outwards.

    They look at the plane through the start that is parallel to the back panel. Every main point is viewed flat (along
    world x) from `distance` metres, then from eight subpoints round it. Main points out of the overview's picture are
    left out and do not count.
    """
    main = 0
    for across, up in _square_spiral(parameters.rings):
        point = np.asarray(start, float) + parameters.spacing * (across * _RIGHT + up * _UP)
        if not _in_view(point, world_from_overview, overview):
            continue
        for sub, (i, j) in enumerate(((0, 0), *_SUBPOINTS)):
            offset = parameters.sub_spacing * (i * _RIGHT + j * _UP)
            yield Viewpoint(9 * main + sub, main, sub, _view(point, parameters.distance, offset, parameters.view_turn))
        main += 1


def _square_spiral(rings: int) -> Iterator[tuple[int, int]]:
    """Steps (right, up) of a square spiral from (0, 0): right, down, left, up, ever longer."""
    across, up, length = 0, 0, 1
    yield across, up
    for turn, (dx, dy) in enumerate([(1, 0), (0, -1), (-1, 0), (0, 1)] * rings):
        for _ in range(length):
            across, up = across + dx, up + dy
            yield across, up
        length += turn % 2


def _view(point: FloatArray, distance: float, offset: FloatArray, view_turn: float) -> "RigidTransform":
    """world_from_camera at `offset` (3,) m from the main point's flat view, turned towards the main point."""
    from scipy.spatial.transform import RigidTransform, Rotation

    from regrasp.interfaces.cell import OPTICAL

    position = point + offset - np.array([distance, 0.0, 0.0])
    inwards = -offset / max(float(np.linalg.norm(offset)), 1e-9)
    turn = Rotation.from_rotvec(view_turn * np.cross([1.0, 0.0, 0.0], inwards))
    return RigidTransform.from_components(position, turn * OPTICAL)


def _in_view(point: FloatArray, world_from_camera: "RigidTransform", camera: Intrinsics) -> bool:
    """Whether a point (3,) m in the world lies in the camera's picture."""
    x, y, z = world_from_camera.inv().apply(point)
    if z <= 0:
        return False
    u, v = camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy
    return bool(-0.5 <= u < camera.width - 0.5 and -0.5 <= v < camera.height - 0.5)


def closer_views(
    world_from_connector: "RigidTransform", parameters: CloseViewParameters = CloseViewParameters()
) -> "Iterator[RigidTransform]":
    """Viewpoints for a closer look at a connector whose pose is known roughly: world_from_camera, the best first.

    They lie on the arms' side (towards -x) and look as square to the connector's axis as may be: there its whole length
    shows, and its tilt in depth.
    """
    from scipy.spatial.transform import RigidTransform, Rotation

    from regrasp.interfaces.cell import OPTICAL

    center = world_from_connector.translation
    axis = world_from_connector.rotation.apply([1.0, 0.0, 0.0])
    grid = np.meshgrid(parameters.distances, np.deg2rad(parameters.yaws_deg), np.deg2rad(parameters.pitches_deg))
    distances, yaws, pitches = (values.transpose(1, 0, 2).ravel() for values in grid)
    turns = Rotation.from_euler("ZY", np.column_stack([yaws, pitches]))  # first down by the pitch, then left by the yaw
    sights = turns.apply([1.0, 0.0, 0.0])
    costs = np.abs(sights @ axis) + parameters.distance_cost * np.abs(distances - parameters.distances[0])
    order = np.argsort(costs, kind="stable")
    views = RigidTransform.from_components(center - distances[:, None] * sights, turns * OPTICAL)
    return (views[int(i)] for i in order)
