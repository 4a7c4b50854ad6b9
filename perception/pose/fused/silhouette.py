"""The outline of a patch of pixels: where the body ends, and where something before it begins.

A stereo camera has no reading beside the left edge of a near thing, in its shadow, nor of what is too near to measure,
such as the hand that carries it. A gap that the body's own shadow explains leaves an edge in sight; any other covers
it.
"""

from dataclasses import dataclass

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

CROSS = np.array([[0, 1, 0], [1, 1, 1], [0, 1, 0]], np.uint8)
STEPS = ((1, 0), (-1, 0), (0, 1), (0, -1))  # (right, down)
LOOK_OUT = (2, 3, 4, 5, 6)  # pixels beyond the edge at which the depth is read: at it readings fly, or a shadow begins
NEARER = 0.006  # m; choice: two deviations of the depth noise at 0.75 m, and less than a cable or finger stands before
SHADOW_SLACK = 4  # pixels that a shadow may be longer: the noise of two depths
AROUND = 9  # pixels; choice: neighbourhood whose readings tell the patch's own depth at its edge


@dataclass(frozen=True, eq=False)
class Outline:
    """Edges between a patch's pixels and their neighbours: `pixels` (n, 2) u, v; `covered` (n,) by a nearer thing."""

    pixels: FloatArray
    covered: NDArray[np.bool_]


def outline(mask: NDArray[np.bool_], depth: NDArray[np.float32], shift: float) -> Outline:
    """The outline of `mask` (H, W) with the depth readings (H, W) m, 0 for none, around it. The image's rim is none.

    `shift` is focal length times baseline, pixels times metres.
    """
    own = _own_depth(mask, depth)
    readings = np.where(depth > 0, depth, np.float32(np.inf))
    height, width = mask.shape
    v, u = np.nonzero(mask & (cv2.erode(mask.view(np.uint8), CROSS) == 0))
    pixels, covered = [], []
    for du, dv in STEPS:
        inside = (u + du >= 0) & (u + du < width) & (v + dv >= 0) & (v + dv < height)
        a, b = u[inside], v[inside]
        edge = ~mask[b + dv, a + du]
        a, b = a[edge], b[edge]
        steps = np.array(LOOK_OUT)[:, None]
        out = np.clip(b + steps * dv, 0, height - 1), np.clip(a + steps * du, 0, width - 1)
        beyond, z = readings[out].min(axis=0), own[b, a]
        gap, behind = _left_of(depth, out[0][0], out[1][0])
        shadow = (du <= 0) & (gap <= shift * (1.0 / z - 1.0 / behind) + SHADOW_SLACK)
        covered.append((beyond < z - NEARER) | (np.isinf(beyond) & ~shadow))
        pixels.append(np.column_stack([a + du / 2, b + dv / 2]))
    return Outline(np.concatenate(pixels), np.concatenate(covered))


@numba.njit(cache=True)
def _left_of(
    depth: NDArray[np.float32], v: NDArray[np.int64], u: NDArray[np.int64]
) -> tuple[NDArray[np.int64], FloatArray]:
    """How many pixels (n,) left of each the next reading is, and the reading; none: the image's width, 0.01 m."""
    gap, reading = np.full(len(u), depth.shape[1]), np.full(len(u), 0.01)
    for i in range(len(u)):
        for left in range(u[i] + 1):
            if depth[v[i], u[i] - left] > 0:
                gap[i], reading[i] = left, depth[v[i], u[i] - left]
                break
    return gap, reading


def _own_depth(mask: NDArray[np.bool_], depth: NDArray[np.float32]) -> NDArray[np.float32]:
    """The mean reading of the patch around each pixel; where it has none there, the patch's median."""
    valid = mask & (depth > 0)
    weight = cv2.boxFilter(valid.astype(np.float32), -1, (AROUND, AROUND), normalize=False)
    total = cv2.boxFilter(np.where(valid, depth, np.float32(0)), -1, (AROUND, AROUND), normalize=False)
    middle = np.float32(np.median(depth[valid])) if valid.any() else np.float32(np.inf)
    return np.where(weight > 0.5, total / np.maximum(weight, np.float32(1)), middle)
