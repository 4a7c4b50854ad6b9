"""The pinhole camera: pixels with depth to points, and points to pixels. Optical frame: x right, y down, z forward."""

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.arrays import DepthImage, FloatArray, Mask
from regrasp.interfaces.frame import Intrinsics

# Depth outside these limits (m) is no reading: RealSense cameras measure from 0.2 to 10.
NEAREST_DEPTH, FARTHEST_DEPTH = 0.01, 50.0


@lru_cache(maxsize=8)  # a pure function of a value; the two cameras and their subsampled images use four entries
def pixel_rays(intrinsics: Intrinsics) -> NDArray[np.float32]:
    """Points at depth 1 through every pixel centre, (H, W, 3), read-only; times depth they are points in metres."""
    x = (np.arange(intrinsics.width) - intrinsics.cx) / intrinsics.fx
    y = (np.arange(intrinsics.height) - intrinsics.cy) / intrinsics.fy
    out = np.ones((intrinsics.height, intrinsics.width, 3), np.float32)
    out[..., 0], out[..., 1] = x, y[:, None]
    out.setflags(write=False)
    return out


def deproject(depth: DepthImage, mask: Mask, intrinsics: Intrinsics, corner: tuple[int, int] = (0, 0)) -> FloatArray:
    """Points (n, 3) m in the optical frame, one for each pixel of `mask` (h, w) with a reading in `depth` (H, W) m.

    The first pixel of the mask is the pixel `corner` (u, v) of the image.
    """
    there = slice(corner[1], corner[1] + mask.shape[0]), slice(corner[0], corner[0] + mask.shape[1])
    z = depth[there][mask]
    valid = (z > NEAREST_DEPTH) & (z < FARTHEST_DEPTH)  # false for NaN
    return (pixel_rays(intrinsics)[there][mask][valid] * z[valid, None]).astype(np.float64)


def project(points: FloatArray, intrinsics: Intrinsics) -> FloatArray:
    r"""Pixels (n, 2), u to the right and v down, of `points` (n, 3) m in the optical frame; NaN behind the camera.

    .. math:: u = f_x x / z + c_x, \quad v = f_y y / z + c_y
    """
    z = np.where(points[:, 2] > 1e-6, points[:, 2], np.nan)
    u = intrinsics.fx * points[:, 0] / z + intrinsics.cx
    v = intrinsics.fy * points[:, 1] / z + intrinsics.cy
    return np.column_stack([u, v])


def hull(points: FloatArray, intrinsics: Intrinsics) -> FloatArray:
    """The convex outline (k, 2) px of `points` (n, 3) m in the optical frame; (0, 2) if one is behind the camera."""
    pixels = project(points, intrinsics)
    if not np.isfinite(pixels).all():
        return np.empty((0, 2))
    return np.asarray(cv2.convexHull(pixels.astype(np.float32))[:, 0], float)


def subsampled(intrinsics: Intrinsics, step: int) -> Intrinsics:
    """The intrinsics of `image[::step, ::step]`."""
    width, height = -(-intrinsics.width // step), -(-intrinsics.height // step)
    fx, fy = intrinsics.fx / step, intrinsics.fy / step
    return Intrinsics(width, height, fx, fy, intrinsics.cx / step, intrinsics.cy / step)
