"""The silhouette of a blob: where the body ends, and where an occluder begins.

A stereo camera has no readings in the shadow beside the left edge of a near body, and none of what is too near to
measure, such as the hand that carries the camera. A gap that the body's own shadow explains leaves the edge in sight;
any other gap counts as an occluder.
"""

from dataclasses import dataclass

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.arrays import DepthImage, FloatArray, Mask

CROSS_KERNEL = np.array([[0, 1, 0], [1, 1, 1], [0, 1, 0]], np.uint8)
NEIGHBOURS = ((1, 0), (-1, 0), (0, 1), (0, -1))  # (right, down)


@dataclass(frozen=True)
class SilhouetteParameters:
    """How an occluder is told from the background."""

    probes: tuple[int, ...] = (2, 3, 4, 5, 6)  # px beyond the edge for depth: at the edge readings fly, or a shadow is
    min_occluder_gap: float = 0.006  # m; choice: two deviations of depth noise at 0.75 m, and less than a cable's
    shadow_slack: int = 4  # px that a shadow may be longer, for the noise of two depths
    depth_window: int = 9  # px; choice: neighbourhood of an edge whose readings give the blob's own depth


@dataclass(frozen=True, eq=False)
class Silhouette:
    """Edges between a blob's pixels and their neighbours."""

    pixels: FloatArray  # (n, 2) u, v: halfway between the two
    occluded: Mask  # (n,), by a nearer thing


def find_silhouette(
    mask: Mask, depth: DepthImage, shift: float, parameters: SilhouetteParameters = SilhouetteParameters()
) -> Silhouette:
    """The silhouette of `mask` (H, W) with the depth readings (H, W) m, 0 for none. The image's border does not count.

    `shift` is focal length times baseline, pixels times metres.
    """
    own = _own_depth(mask, depth, parameters.depth_window)
    readings = np.where(depth > 0, depth, np.float32(np.inf))
    height, width = mask.shape
    probes = np.array(parameters.probes)[:, None]
    v, u = np.nonzero(mask & (cv2.erode(mask.view(np.uint8), CROSS_KERNEL) == 0))
    pixels, occluded = [], []
    for du, dv in NEIGHBOURS:
        inside = (u + du >= 0) & (u + du < width) & (v + dv >= 0) & (v + dv < height)
        a, b = u[inside], v[inside]
        edge = ~mask[b + dv, a + du]
        a, b = a[edge], b[edge]
        out = np.clip(b + probes * dv, 0, height - 1), np.clip(a + probes * du, 0, width - 1)
        beyond, z = readings[out].min(axis=0), own[b, a]
        gap, behind = _reading_to_the_left(depth, out[0][0], out[1][0])
        shadow = (du <= 0) & (gap <= shift * (1.0 / z - 1.0 / behind) + parameters.shadow_slack)
        occluded.append((beyond < z - parameters.min_occluder_gap) | (np.isinf(beyond) & ~shadow))
        pixels.append(np.column_stack([a + du / 2, b + dv / 2]))
    return Silhouette(np.concatenate(pixels), np.concatenate(occluded))


@numba.njit(cache=True)
def _reading_to_the_left(
    depth: NDArray[np.float32], v: NDArray[np.int64], u: NDArray[np.int64]
) -> tuple[NDArray[np.int64], FloatArray]:
    """How many pixels (n,) left of each the next reading is, and the reading; if none, the image's width and 0.01 m."""
    gap, reading = np.full(len(u), depth.shape[1]), np.full(len(u), 0.01)
    for i in range(len(u)):
        for left in range(u[i] + 1):
            if depth[v[i], u[i] - left] > 0:
                gap[i], reading[i] = left, depth[v[i], u[i] - left]
                break
    return gap, reading


def _own_depth(mask: Mask, depth: DepthImage, window: int) -> DepthImage:
    """The mean reading of the blob around each pixel; where it has none there, the blob's median."""
    valid = mask & (depth > 0)
    weight = cv2.boxFilter(valid.astype(np.float32), -1, (window, window), normalize=False)
    total = cv2.boxFilter(np.where(valid, depth, np.float32(0)), -1, (window, window), normalize=False)
    median = np.float32(np.median(depth[valid])) if valid.any() else np.float32(np.inf)
    return np.where(weight > 0.5, total / np.maximum(weight, np.float32(1)), median)
