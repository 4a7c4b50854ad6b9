"""The errors of a stereo depth camera, after the figures that RealSense publishes."""

import zlib
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from regrasp.interfaces.arrays import DepthImage, Mask
from regrasp.interfaces.cell import CameraSpec
from regrasp.interfaces.hidden_world import Errors


@dataclass(frozen=True)
class DepthNoiseParameters:
    """The stereo matcher of a depth camera."""

    max_disparity: float = 126.0  # px that a RealSense D4xx searches; it sets the smallest range
    depth_step: float = 0.001  # m, the sensor's unit of depth
    # px, standard deviation of the Gaussian filter: the noise's autocorrelation falls to 1/e at twice this.
    smoothing: float = 2.0  # choice: half of a matching window
    tile: tuple[int, int] = (512, 1024)  # px, size of the periodic noise tiles; powers of two
    edge_step: float = 0.03  # share of the depth by which neighbours differ at an edge between two surfaces; choice
    flying_share: float = 0.5  # share of the pixels beside such an edge that are flying pixels; choice


class DepthNoise:
    r"""Makes an exact depth image, aligned to colour, look as if a stereo camera had measured it.

    Disparity noise with a standard deviation of s pixels (`errors.depth_subpixel`) gives a depth Z the deviation

    .. math:: \sigma_Z = Z^2 s / (f B)

    with the baseline B and the focal length f of the depth imager, in pixels (its own field of view over the image's
    width). The noise of neighbours is correlated, and a share of its variance is the same in all frames, as on a real
    camera in front of a static scene. Draws are keyed by seed, camera and frame number.

    The rest of the noise is the sum of two periodic tiles of unit-variance smooth Gaussian noise, each shifted by a
    random offset in each frame. Over many frames each pixel samples the whole tiles: mean 0 and variance 1 as with
    independent draws. Two frames are independent unless the shifts of a tile come within some 8 pixels of each other
    (1 pair in 2,000).
    """

    def __init__(
        self, spec: CameraSpec, errors: Errors, seed: int, parameters: DepthNoiseParameters = DepthNoiseParameters()
    ) -> None:
        self._parameters = parameters
        self._key = (seed, zlib.crc32(spec.name.encode()))
        scale, fixed, tiles = (np.random.default_rng([*self._key, concern]) for concern in range(3))
        self.scale = 1.0 + errors.depth_scale * float(np.clip(scale.standard_normal(), -2.0, 2.0))
        share, smoothing = errors.depth_fixed_share, parameters.smoothing
        self._fixed = smooth_noise((spec.height, spec.width), fixed, smoothing) * np.float32(np.sqrt(share))
        self._tiles = np.stack([smooth_noise(parameters.tile, tiles, smoothing) for _ in range(2)]) * np.float32(
            np.sqrt((1.0 - share) / 2)
        )
        k = spec.intrinsics
        half_view = float(np.tan(np.deg2rad(spec.depth_fov_deg) / 2))
        focal_baseline = 0.5 * spec.width / half_view * spec.baseline
        self._figures = np.array(
            (
                self.scale,
                errors.depth_subpixel / focal_baseline,
                focal_baseline / parameters.max_disparity,
                parameters.depth_step,
                1.0 / parameters.depth_step,
                parameters.edge_step,
                parameters.flying_share,
            ),
            np.float32,
        )
        # Columns of the colour image where the depth imager's view begins and ends.
        self._view = (np.float32(k.cx - half_view * k.fx), np.float32(k.cx + half_view * k.fx))
        self._shift = np.float32(k.fx * spec.baseline)

    def apply(self, depth: DepthImage, number: int) -> DepthImage:
        """The measured image (H, W) for the exact one (H, W) in frame `number`; both in metres, 0 for no reading."""
        rng = np.random.default_rng([*self._key, 3, number])
        shifts = rng.integers(0, [self._parameters.tile, self._parameters.tile])
        key = np.uint32(rng.integers(2**32))
        seen = _seen(depth, self._shift, *self._view)
        return _measure(depth, seen, self._fixed, self._tiles, shifts, key, self._figures)


def smooth_noise(shape: tuple[int, int], rng: np.random.Generator, smoothing: float) -> NDArray[np.float32]:
    """A periodic field of Gaussian noise, smoothed by a Gaussian filter of `smoothing` px, with mean 0, variance 1."""
    field = gaussian_filter(rng.standard_normal(shape, np.float32), smoothing, mode="wrap")
    field -= field.mean()
    smooth: NDArray[np.float32] = field / field.std()
    return smooth


@numba.njit(cache=True, error_model="numpy")
def _seen(depth: DepthImage, shift: np.float32, begin: np.float32, end: np.float32) -> Mask:
    """Pixels that both imagers see.

    The right imager, B to the right, sees the point of column u at u - shift / Z. There a nearer surface, which shifts
    farther to the left, occludes what lies beside its left edge: B f (1/Znear - 1/Zfar) pixels. What lands left of the
    image's begin (B f / Z pixels) is not seen at all.
    """
    height, width = depth.shape
    seen = np.empty((height, width), np.bool_)
    there, least = np.empty(width, np.float32), np.empty(width, np.float32)
    nowhere = np.float32(1e9)
    for v in range(height):
        # Three loops: the compiler works on several pixels at once in the first and the last.
        for u in range(width):
            z = depth[v, u]
            there[u] = np.float32(u) - shift / z if z > 0 else nowhere
        leftmost = nowhere
        for u in range(width - 1, -1, -1):
            least[u] = leftmost
            leftmost = there[u] if there[u] < leftmost else leftmost
        for u in range(width):
            seen[v, u] = (there[u] < least[u]) & (there[u] >= begin) & (np.float32(u) <= end)
    return seen


@numba.njit(cache=True, error_model="numpy")
def _measure(
    depth: DepthImage,
    seen: Mask,
    fixed: NDArray[np.float32],
    tiles: NDArray[np.float32],
    shifts: NDArray[np.int64],
    key: np.uint32,
    figures: NDArray[np.float32],
) -> DepthImage:
    """Measured depth of the pixels in `seen`.

    `figures` (7,): scale, standard deviation of 1/Z (1/m), smallest range (m), depth step (m), its inverse (1/m), edge
    step, share of flying pixels.
    """
    height, width = depth.shape
    scale, noise, smallest, step, steps_per_metre, edge_step, flying_share = figures
    rows = tiles.shape[1] - 1
    out = np.zeros((height, width), np.float32)
    jitter, flown = np.empty(width, np.float32), np.empty(width, np.float32)
    near, far = np.empty(width, np.float32), np.empty(width, np.float32)
    for v in range(height):
        jitter[:] = np.float32(0.0)
        for tile in range(2):
            _add_wrapped(tiles[tile, (v + shifts[tile, 0]) & rows], shifts[tile, 1], jitter)
        _neighbours(depth, v, near, far)
        _fly(depth, v, near, far, key, edge_step, flying_share, flown)
        for u in range(width):
            z = flown[u]
            z = scale * z / (np.float32(1.0) + noise * (fixed[v, u] + jitter[u]) * z)
            measured = np.float32(np.rint(z * steps_per_metre)) * step
            out[v, u] = measured if seen[v, u] and z >= smallest else np.float32(0.0)
    return out


@numba.njit(cache=True, error_model="numpy")
def _add_wrapped(row: NDArray[np.float32], shift: int, out: NDArray[np.float32]) -> None:
    """Add a periodic row, from its column `shift` on, to `out` (W,)."""
    done = 0
    while done < len(out):
        begin = (shift + done) % len(row)
        count = min(len(row) - begin, len(out) - done)
        part, more = out[done : done + count], row[begin : begin + count]
        for u in range(count):
            part[u] += more[u]
        done += count


@numba.njit(cache=True, error_model="numpy")
def _neighbours(depth: DepthImage, v: int, near: NDArray[np.float32], far: NDArray[np.float32]) -> None:
    """The least and the greatest depth of each pixel of row `v` and its four neighbours, those without depth aside."""
    height, width = depth.shape
    here, up, down = depth[v], depth[max(v - 1, 0)], depth[min(v + 1, height - 1)]
    for u in range(width):
        z, a, b = here[u], up[u], down[u]
        near[u] = min(z, min(a if a > 0 else z, b if b > 0 else z))
        far[u] = max(z, max(a, b))
    for u in range(width - 1):
        right = here[u + 1]
        near[u], far[u] = min(near[u], right if right > 0 else near[u]), max(far[u], right)
    for u in range(1, width):
        left = here[u - 1]
        near[u], far[u] = min(near[u], left if left > 0 else near[u]), max(far[u], left)


@numba.njit(cache=True, error_model="numpy")
def _fly(
    depth: DepthImage,
    v: int,
    near: NDArray[np.float32],
    far: NDArray[np.float32],
    key: np.uint32,
    edge_step: np.float32,
    flying_share: np.float32,
    out: NDArray[np.float32],
) -> None:
    """The depths of row `v`; beside an edge, for a share of the pixels, random depths between the two surfaces."""
    width = depth.shape[1]
    for u in range(width):
        z = depth[v, u]
        out[u] = z
        if max(far[u] - z, z - near[u]) >= edge_step * near[u]:
            chance = _hash(key, v * width + u)
            if chance < flying_share:
                out[u] = near[u] + (far[u] - near[u]) * chance / flying_share


@numba.njit(cache=True, inline="always")
def _hash(key: np.uint32, index: int) -> np.float32:
    """A number in [0, 1) from a frame's key and a pixel's index: the finaliser of MurmurHash3 (Appleby)."""
    h = np.uint32(key ^ np.uint32(index))
    h = np.uint32((h ^ (h >> np.uint32(16))) * np.uint32(0x85EBCA6B))
    h = np.uint32((h ^ (h >> np.uint32(13))) * np.uint32(0xC2B2AE35))
    h = np.uint32(h ^ (h >> np.uint32(16)))
    return np.float32(h >> np.uint32(8)) * np.float32(2.0**-24)
