"""The errors of a stereo depth camera, after RealSense's published figures."""

import zlib

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from regrasp.interfaces.cell import CameraSpec
from regrasp.interfaces.hidden_world import Errors

MAX_DISPARITY = 126.0  # pixels that a RealSense D4xx searches; it sets the least range
QUANTUM = 0.001  # metres
SMOOTHING = (
    2.0  # pixels: the noise's autocorrelation falls to 1/e at twice this (choice: 4 px, a matching window's half)
)
TILE = (512, 1024)  # pixels: size of the periodic noise tiles
EDGE = 0.03  # share of the depth by which neighbours differ at an edge between two surfaces (choice)
FLYING_SHARE = 0.5  # share of the pixels on either side of an edge that fly (choice)


class DepthNoise:
    """Makes an exact depth image, aligned to colour, look as if a stereo camera had measured it.

    Disparity noise of `errors.depth_subpixel` pixels gives sigma_z = Z^2 s / (f B), with f in pixels of the depth
    imager (its own field of view over the image's width); neighbours are correlated. A share of the variance stays from
    frame to frame, as on a real camera in front of a still scene. Draws are keyed by seed, camera and frame number.

    The fresh noise is the sum of two periodic tiles of unit-variance smooth Gaussian noise, each shifted by a random
    offset per frame. Over frames a pixel so samples the whole tiles: mean 0 and variance 1 as with fresh draws, and two
    frames are independent unless the shifts of a tile come within some 8 pixels of each other (1 pair in 2,000).
    """

    def __init__(self, spec: CameraSpec, errors: Errors, seed: int) -> None:
        self._key = (seed, zlib.crc32(spec.name.encode()))
        scale, fixed, tiles = (np.random.default_rng([*self._key, concern]) for concern in range(3))
        self.scale = 1.0 + errors.depth_scale * float(np.clip(scale.standard_normal(), -2.0, 2.0))
        share = errors.depth_fixed_share
        self._fixed = smooth_noise((spec.height, spec.width), fixed) * np.float32(np.sqrt(share))
        self._tiles = np.stack([smooth_noise(TILE, tiles) for _ in range(2)]) * np.float32(np.sqrt((1.0 - share) / 2))
        k = spec.intrinsics
        half_view = float(np.tan(np.deg2rad(spec.depth_fov_deg) / 2))
        focal_baseline = 0.5 * spec.width / half_view * spec.baseline
        figures = (self.scale, errors.depth_subpixel / focal_baseline, focal_baseline / MAX_DISPARITY)
        self._figures = np.array(figures, np.float32)
        # columns where the depth imager's view begins and ends, in the colour image
        self._view = (np.float32(k.cx - half_view * k.fx), np.float32(k.cx + half_view * k.fx))
        self._shift = np.float32(k.fx * spec.baseline)

    def apply(self, depth: NDArray[np.float32], number: int) -> NDArray[np.float32]:
        """The measured image (H, W) for the exact one (H, W), both metres with 0 for none, at frame `number`."""
        rng = np.random.default_rng([*self._key, 3, number])
        shifts = rng.integers(0, [TILE, TILE])
        key = np.uint32(rng.integers(2**32))
        seen = _seen(depth, self._shift, *self._view)
        return _measure(depth, seen, self._fixed, self._tiles, shifts, key, self._figures)


def smooth_noise(shape: tuple[int, int], rng: np.random.Generator) -> NDArray[np.float32]:
    """A periodic field of smooth Gaussian noise with mean 0 and variance 1."""
    field = gaussian_filter(rng.standard_normal(shape, np.float32), SMOOTHING, mode="wrap")
    field -= field.mean()
    smooth: NDArray[np.float32] = field / field.std()
    return smooth


@numba.njit(cache=True, error_model="numpy")
def _seen(depth: NDArray[np.float32], shift: np.float32, begin: np.float32, end: np.float32) -> NDArray[np.bool_]:
    """Pixels that both imagers see.

    The right imager, B to the right, sees the point of column u at u - shift / Z. There a nearer surface, which shifts
    farther to the left, hides what lies beside its left edge: B f (1/Znear - 1/Zfar) pixels; and what lands left of the
    image's begin (B f / Z pixels) is not seen at all.
    """
    height, width = depth.shape
    seen = np.zeros((height, width), np.bool_)
    for v in range(height):
        leftmost = np.float32(1e9)
        for u in range(width - 1, -1, -1):
            z = depth[v, u]
            if z > 0:
                there = np.float32(u) - shift / z
                seen[v, u] = there < leftmost and there >= begin and u <= end
                leftmost = min(leftmost, there)
    return seen


@numba.njit(cache=True, error_model="numpy")
def _measure(
    depth: NDArray[np.float32],
    seen: NDArray[np.bool_],
    fixed: NDArray[np.float32],
    tiles: NDArray[np.float32],
    shifts: NDArray[np.int64],
    key: np.uint32,
    figures: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Measured depth of the pixels seen; `figures`: scale, standard deviation of 1/Z (1/m), least range (m)."""
    height, width = depth.shape
    scale, noise, least = figures
    out = np.zeros((height, width), np.float32)
    for v in range(height):
        first = tiles[0, (v + shifts[0, 0]) & (TILE[0] - 1)]
        second = tiles[1, (v + shifts[1, 0]) & (TILE[0] - 1)]
        for u in range(width):
            if not seen[v, u]:
                continue
            z = _flying(depth, v, u, key)
            jitter = fixed[v, u]
            jitter += first[(u + shifts[0, 1]) & (TILE[1] - 1)] + second[(u + shifts[1, 1]) & (TILE[1] - 1)]
            z = scale * z / (np.float32(1.0) + noise * jitter * z)
            if z >= least:
                out[v, u] = np.float32(np.rint(z * np.float32(1.0 / QUANTUM))) * np.float32(QUANTUM)
    return out


@numba.njit(cache=True, inline="always", error_model="numpy")
def _flying(depth: NDArray[np.float32], v: int, u: int, key: np.uint32) -> np.float32:
    """The pixel's depth; beside an edge, now and then one between the two surfaces."""
    z = depth[v, u]
    near = far = z
    for dv, du in ((0, -1), (0, 1), (-1, 0), (1, 0)):
        if 0 <= v + dv < depth.shape[0] and 0 <= u + du < depth.shape[1] and depth[v + dv, u + du] > 0:
            near = min(near, depth[v + dv, u + du])
            far = max(far, depth[v + dv, u + du])
    if max(far - z, z - near) < np.float32(EDGE) * near:
        return z
    chance = _hash(key, v * depth.shape[1] + u)
    if chance >= np.float32(FLYING_SHARE):
        return z
    return near + (far - near) * chance / np.float32(FLYING_SHARE)


@numba.njit(cache=True, inline="always")
def _hash(key: np.uint32, index: int) -> np.float32:
    """A number in [0, 1) from a frame's key and a pixel: the finaliser of MurmurHash3 (Appleby, public domain)."""
    h = np.uint32(key ^ np.uint32(index))
    h = np.uint32((h ^ (h >> np.uint32(16))) * np.uint32(0x85EBCA6B))
    h = np.uint32((h ^ (h >> np.uint32(13))) * np.uint32(0xC2B2AE35))
    h = np.uint32(h ^ (h >> np.uint32(16)))
    return np.float32(h >> np.uint32(8)) * np.float32(2.0**-24)
