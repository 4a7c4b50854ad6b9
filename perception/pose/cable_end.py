"""Tells from a depth image whether the cable leaves an end of the connector."""

from dataclasses import dataclass

import numpy as np

from regrasp.interfaces.arrays import DepthImage, FloatArray
from regrasp.interfaces.frame import Intrinsics
from regrasp.perception.camera.model import project


@dataclass(frozen=True)
class CableEndParameters:
    """Arcs of pixels beyond the end, in which the cable is looked for, and how wide it may be there."""

    radii: tuple[float, ...] = (0.012, 0.016, 0.020)  # m; choice: outside the end's noisy rim, before the cable bends
    angles: tuple[float, ...] = tuple(np.deg2rad(np.arange(-60.0, 61.0, 5.0)).tolist())  # rad, from the axis
    depth_tolerance: float = 0.02  # m; choice: a cable is this near to the end's depth; a panel 0.1 m behind is not
    width: tuple[int, int] = (1, 12)  # of the 25 angles; a cable of 7 mm fills 4 at 16 mm, more if bent; a wall all
    min_arcs: int = 2  # on which a narrow thing shows
    bare_share: float = 0.9  # of the angles with a reading far behind, on every arc: no cable leaves here
    min_sine: float = 0.5  # choice: of axis and line of sight; below, the connector may hide its own cable


def cable_leaves(
    depth: DepthImage,
    end: FloatArray,
    outward: FloatArray,
    intrinsics: Intrinsics,
    parameters: CableEndParameters = CableEndParameters(),
) -> bool | None:
    """Whether a narrow thing goes on from the `end` (3,) m, optical frame, about the unit direction `outward` (3,).

    `depth` is (H, W) m, 0 for no reading. The colour does not matter; a socket or a finger is too wide. None where the
    view does not tell: something hides what is beyond, or the axis is too near to the line of sight.
    """
    pixels = project(np.array([end, end + 0.01 * outward]), intrinsics)
    step = pixels[1] - pixels[0]
    if float(np.linalg.norm(step)) < parameters.min_sine * 0.01 * intrinsics.fx / end[2]:
        return None
    heading = np.arctan2(step[1], step[0]) + np.array(parameters.angles)
    narrow = bare = 0
    for radius in parameters.radii:
        length = radius * intrinsics.fx / end[2]
        u, v = np.rint(pixels[0][:, None] + length * np.array([np.cos(heading), np.sin(heading)])).astype(int)
        inside = (u >= 0) & (u < intrinsics.width) & (v >= 0) & (v < intrinsics.height)
        reading = np.where(inside, depth[v.clip(0, intrinsics.height - 1), u.clip(0, intrinsics.width - 1)], 0.0)
        alike = int(np.count_nonzero((reading > 0) & (np.abs(reading - end[2]) < parameters.depth_tolerance)))
        narrow += parameters.width[0] <= alike <= parameters.width[1]
        behind = int(np.count_nonzero(reading > end[2] + parameters.depth_tolerance))
        bare += behind >= parameters.bare_share * len(heading)
    if narrow >= parameters.min_arcs:
        return True
    return False if bare == len(parameters.radii) else None
