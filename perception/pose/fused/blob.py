"""What a frame shows of each blob of a colour: depth readings, silhouette and surroundings, for a cylinder's fit."""

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.arrays import DepthImage, FloatArray, Mask
from regrasp.interfaces.cell import CameraSpec
from regrasp.interfaces.frame import Intrinsics, RgbdFrame
from regrasp.perception.camera.model import FARTHEST_DEPTH, NEAREST_DEPTH
from regrasp.perception.pose.fused.cylinder_fit import Observation
from regrasp.perception.pose.fused.silhouette import SilhouetteParameters, find_silhouette


@dataclass(frozen=True)
class BlobParameters:
    """Which blobs count, and the noise of what they show."""

    min_area: int = 40  # pixels; choice: 3 % of the connector at 0.75 m; less tells no shape
    max_count: int = 4  # blobs that are tried, the largest ones
    margin: int = 60  # px around a blob that are kept: beyond its ends the cable shows, and what casts a shadow
    disparity_noise: float = 0.2  # px; a RealSense in honest use, 0.08 at its best
    quantization_noise: float = 0.0003  # m: deviation of a reading rounded to millimetres
    independent_area: float = 20.0  # pixels an independent reading; choice: a stereo matching window of some 5 pixels
    silhouette_deviation: float = 0.5  # px, of a silhouette point
    independent_silhouette_share: float = 0.6  # of its points count as independent: neighbours are rounded alike
    max_points: int = 200  # readings, for speed; neighbouring readings err alike, and more change no result
    max_rays: int = 160  # silhouette points, likewise
    silhouette: SilhouetteParameters = field(default_factory=SilhouetteParameters)


@dataclass(frozen=True)
class Stereo:
    """A stereo depth camera: `baseline` in m; `noise` in 1/m, the deviation of a reading over its square."""

    baseline: float
    noise: float

    @classmethod
    def of(cls, camera: CameraSpec, disparity_noise: float) -> "Stereo":
        r"""That of a camera of the cell, from its `disparity_noise` (px).

        .. math:: \sigma_z = z^2 \sigma_d / (f b)
        """
        focal = 0.5 * camera.width / float(np.tan(np.deg2rad(camera.depth_fov_deg) / 2))
        return cls(camera.baseline, disparity_noise / (focal * camera.baseline))


REALSENSE_D415 = Stereo(0.055, 0.0055)  # stands for a camera that is not in the cell


@dataclass(frozen=True, eq=False)
class BlobMask:
    """A window of the frame with one blob of the colour."""

    mask: Mask  # (h, w), of the blob
    others: Mask  # (h, w), of the other pixels of the colour
    window: tuple[slice, slice]  # rows and columns in the frame
    touches_border: bool  # the blob reaches the picture's border


@dataclass(frozen=True, eq=False)
class Blob:
    """A blob of the colour in the optical frame: what to fit, and what is seen around it."""

    found: BlobMask
    depth: DepthImage  # (h, w) m, scale corrected
    intrinsics: Intrinsics  # of the window
    observation: Observation
    area: int  # pixels


def find_blobs(binary: NDArray[np.uint8], parameters: BlobParameters) -> list[BlobMask]:
    """The largest blobs of a colour mask (H, W), largest first."""
    contours, _ = cv2.findContours(binary, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    found, margin = [], parameters.margin
    for contour in sorted(contours, key=cv2.contourArea, reverse=True)[: parameters.max_count]:
        u, v, width, height = cv2.boundingRect(contour)
        u0, v0 = max(0, u - margin), max(0, v - margin)
        window = np.s_[v0 : v + height + margin, u0 : u + width + margin]
        filled = np.zeros_like(binary[window])
        cv2.drawContours(filled, [contour], -1, 255, cv2.FILLED, offset=(-u0, -v0))
        cv2.bitwise_and(filled, binary[window], dst=filled)
        if cv2.countNonZero(filled) >= parameters.min_area:
            at_border = u == 0 or v == 0 or u + width == binary.shape[1] or v + height == binary.shape[0]
            found.append(BlobMask(filled > 0, binary[window] > filled, window, at_border))
    return found


def observe(frame: RgbdFrame, found: BlobMask, scale: float, stereo: Stereo, parameters: BlobParameters) -> Blob:
    """Gather the readings and the silhouette of the blob; `scale` is the factor that corrects depth."""
    mask, window = found.mask, found.window
    k, v0, u0 = frame.intrinsics, window[0].start, window[1].start
    depth = frame.depth[window]
    depth = np.where((depth > NEAREST_DEPTH) & (depth < FARTHEST_DEPTH), depth * np.float32(scale), np.float32(0))
    here = Intrinsics(mask.shape[1], mask.shape[0], k.fx, k.fy, k.cx - u0, k.cy - v0)
    core = cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    v, u = np.nonzero(core & (depth > 0))
    chosen = np.s_[:: 1 + len(u) // parameters.max_points]
    z = depth[v, u][chosen].astype(float)
    points = rays_through(np.column_stack([u, v])[chosen], here) * z[:, None]
    silhouette = find_silhouette(mask, depth, stereo.baseline * k.fx, parameters.silhouette)
    some = np.s_[:: 1 + len(silhouette.pixels) // parameters.max_rays]
    rays = rays_through(silhouette.pixels[some], here)
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    independent = len(u) / parameters.independent_area / max(1, len(points))
    observation = Observation(
        points,
        stereo.noise * z**2 + parameters.quantization_noise,
        rays,
        np.full(len(rays), parameters.silhouette_deviation / k.fx),
        silhouette.occluded[some].copy(),
        min(1.0, independent),
        min(1.0, parameters.independent_silhouette_share * len(silhouette.pixels) / max(1, len(rays))),
    )
    return Blob(found, depth, here, observation, int(np.count_nonzero(mask)))


def rays_through(pixels: NDArray[np.generic], k: Intrinsics) -> FloatArray:
    """Points (n, 3) at depth 1 on the rays through `pixels` (n, 2)."""
    u, v = np.asarray(pixels, float).T
    return np.column_stack([(u - k.cx) / k.fx, (v - k.cy) / k.fy, np.ones(len(u))])
