"""The pinhole camera: pixels with depth to points, and points to pixels. Optical frame: x right, y down, z forward."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.frame import Intrinsics

FloatArray = NDArray[np.float64]

NEAREST, FURTHEST = 0.01, 50.0  # m; choice: no such camera measures nearer or further, RealSense 0.2 to 10


@lru_cache(maxsize=8)  # a pure function of a value; the two cameras and their subsampled images use four entries
def rays(intrinsics: Intrinsics) -> NDArray[np.float32]:
    """Points at depth 1 through every pixel centre, (H, W, 3), read-only; times depth they are points in metres."""
    x = (np.arange(intrinsics.width) - intrinsics.cx) / intrinsics.fx
    y = (np.arange(intrinsics.height) - intrinsics.cy) / intrinsics.fy
    out = np.ones((intrinsics.height, intrinsics.width, 3), np.float32)
    out[..., 0], out[..., 1] = x, y[:, None]
    out.setflags(write=False)
    return out


def deproject(
    depth: NDArray[np.float32], mask: NDArray[np.bool_], intrinsics: Intrinsics, corner: tuple[int, int] = (0, 0)
) -> FloatArray:
    """Points (n, 3) m in the optical frame of those pixels of `mask` (h, w) whose `depth` (H, W) m is a reading.

    The mask's first pixel is `corner` (u, v) of the image.
    """
    there = slice(corner[1], corner[1] + mask.shape[0]), slice(corner[0], corner[0] + mask.shape[1])
    z = depth[there][mask]
    valid = (z > NEAREST) & (z < FURTHEST)  # false for NaN
    return (rays(intrinsics)[there][mask][valid] * z[valid, None]).astype(np.float64)


def project(points: FloatArray, intrinsics: Intrinsics) -> FloatArray:
    """Pixels (n, 2), u to the right and v down, of `points` (n, 3) m in the optical frame; NaN for those behind."""
    z = np.where(points[:, 2] > 1e-6, points[:, 2], np.nan)
    u = intrinsics.fx * points[:, 0] / z + intrinsics.cx
    v = intrinsics.fy * points[:, 1] / z + intrinsics.cy
    return np.column_stack([u, v])


def in_view(points: FloatArray, intrinsics: Intrinsics, margin: float = 0.0) -> NDArray[np.bool_]:
    """Whether each of `points` (n, 3) m in the optical frame is in the image, `margin` pixels inside; (n,)."""
    pixels = project(points, intrinsics)
    high = np.array([intrinsics.width, intrinsics.height]) - 0.5 - margin
    return np.all((pixels >= margin - 0.5) & (pixels <= high), axis=1)  # NaN compares false: behind is not in view


def subsampled(intrinsics: Intrinsics, step: int) -> Intrinsics:
    """The camera of `image[::step, ::step]`."""
    width, height = -(-intrinsics.width // step), -(-intrinsics.height // step)
    fx, fy = intrinsics.fx / step, intrinsics.fy / step
    return Intrinsics(width, height, fx, fy, intrinsics.cx / step, intrinsics.cy / step)
