"""Which end of the connector the cable leaves."""

import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.frame import Intrinsics
from regrasp.perception.camera.model import project

FloatArray = NDArray[np.float64]

REACH = (0.012, 0.016, 0.020)  # m beyond the end; choice: outside the end's own noisy rim, before the cable bends away
ARC = np.deg2rad(np.arange(-60.0, 61.0, 5.0))  # directions about the axis in the image
NEAR = 0.02  # m; choice: a cable this far before or behind the end is still its own; a panel 0.1 behind is not
WIDTH = (1, 12)  # directions of the 25 that a cable of 7 mm fills, 4 at 16 mm, with its bend; a wall fills all
AGREE = 2  # of the reaches
BARE_SHARE = 0.9  # of the directions show what is far behind: nothing leaves here
ASLANT = 0.5  # choice: sine of the angle to the line of sight under which the cable may be hidden by the connector


def cable_leaves(
    depth: NDArray[np.float32], end: FloatArray, outward: FloatArray, intrinsics: Intrinsics
) -> bool | None:
    """Whether a narrow thing goes on from the `end` (3,) m, optical frame, about the unit direction `outward` (3,).

    `depth` is (H, W) m, 0 for no reading. Any colour will do; a socket or a finger is too wide. None where the view
    does not tell: something hides what is beyond, or it is too much along the line of sight.
    """
    pixels = project(np.array([end, end + 0.01 * outward]), intrinsics)
    step = pixels[1] - pixels[0]
    if float(np.linalg.norm(step)) < ASLANT * 0.01 * intrinsics.fx / end[2]:
        return None
    heading = np.arctan2(step[1], step[0]) + ARC
    narrow = bare = 0
    for reach in REACH:
        length = reach * intrinsics.fx / end[2]
        u, v = np.rint(pixels[0][:, None] + length * np.array([np.cos(heading), np.sin(heading)])).astype(int)
        inside = (u >= 0) & (u < intrinsics.width) & (v >= 0) & (v < intrinsics.height)
        reading = np.where(inside, depth[v.clip(0, intrinsics.height - 1), u.clip(0, intrinsics.width - 1)], 0.0)
        there = int(np.count_nonzero((reading > 0) & (np.abs(reading - end[2]) < NEAR)))
        narrow += WIDTH[0] <= there <= WIDTH[1]
        bare += int(np.count_nonzero(reading > end[2] + NEAR)) >= BARE_SHARE * len(ARC)
    if narrow >= AGREE:
        return True
    return False if bare == len(REACH) else None
