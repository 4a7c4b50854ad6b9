"""What a frame shows of each patch of a colour: depth readings, outline and surroundings, for a cylinder's fit."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.cell import CameraSpec
from regrasp.interfaces.frame import Intrinsics, RgbdFrame
from regrasp.perception.camera.model import FURTHEST, NEAREST
from regrasp.perception.pose.fused.cylinder import Sight
from regrasp.perception.pose.fused.silhouette import outline

FloatArray = NDArray[np.float64]
Mask = NDArray[np.bool_]

MIN_AREA = 40  # pixels; choice: 3 % of the connector at 0.75 m; less tells no shape
PATCHES = 4  # the largest patches of the colour are tried
MARGIN = 60  # pixels round a patch that are looked at: what is beyond its ends tells too, and beyond its shadow
DISPARITY_NOISE = 0.2  # pixels; RealSense in honest use, 0.08 at its best
QUANTUM = 0.0003  # m: deviation of a reading rounded to millimetres
INDEPENDENT_AREA = 20.0  # pixels an independent reading; choice: a stereo matching window of some 5 pixels
EDGE_WIDTH = 0.5  # pixels: deviation of an outline point
EDGE_SHARE = 0.6  # of the outline's points count as independent: neighbours are rounded alike
POINTS, EDGES = 200, 160  # at most, for speed; neighbouring readings err alike, more change no result


@dataclass(frozen=True)
class Stereo:
    """A depth imager: its `baseline` in m, and its `noise`, a reading's deviation over its square in 1/m."""

    baseline: float
    noise: float

    @classmethod
    def of(cls, camera: CameraSpec) -> "Stereo":
        """That of a camera of the cell."""
        focal = 0.5 * camera.width / float(np.tan(np.deg2rad(camera.depth_fov_deg) / 2))
        return cls(camera.baseline, DISPARITY_NOISE / (focal * camera.baseline))


D415 = Stereo(0.055, 0.0055)  # of a camera that is not in the cell


@dataclass(frozen=True, eq=False)
class Cut:
    """A `window` of the frame: the `mask` (h, w) of one patch of the colour there, and of the `others`.

    `broken_off`: the patch reaches the picture's rim.
    """

    mask: Mask
    others: Mask
    window: tuple[slice, slice]
    broken_off: bool


@dataclass(frozen=True, eq=False)
class Patch:
    """A patch of the colour in the camera's frame: what to fit, and what is seen around it."""

    cut: Cut
    depth: NDArray[np.float32]  # (h, w) m, scale corrected
    intrinsics: Intrinsics  # of the window
    sight: Sight
    area: int


def patches(binary: NDArray[np.uint8]) -> list[Cut]:
    """The largest patches of a colour mask (H, W), largest first."""
    contours, _ = cv2.findContours(binary, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    found = []
    for contour in sorted(contours, key=cv2.contourArea, reverse=True)[:PATCHES]:
        u, v, width, height = cv2.boundingRect(contour)
        u0, v0 = max(0, u - MARGIN), max(0, v - MARGIN)
        window = np.s_[v0 : v + height + MARGIN, u0 : u + width + MARGIN]
        filled = np.zeros_like(binary[window])
        cv2.drawContours(filled, [contour], -1, 255, cv2.FILLED, offset=(-u0, -v0))
        cv2.bitwise_and(filled, binary[window], dst=filled)
        if cv2.countNonZero(filled) >= MIN_AREA:
            broken_off = u == 0 or v == 0 or u + width == binary.shape[1] or v + height == binary.shape[0]
            found.append(Cut(filled > 0, binary[window] > filled, window, broken_off))
    return found


def look(frame: RgbdFrame, cut: Cut, scale: float, stereo: Stereo) -> Patch:
    """Gather the readings and the outline of the patch."""
    mask, window = cut.mask, cut.window
    k, v0, u0 = frame.intrinsics, window[0].start, window[1].start
    depth = frame.depth[window]
    depth = np.where((depth > NEAREST) & (depth < FURTHEST), depth * np.float32(scale), np.float32(0))
    here = Intrinsics(mask.shape[1], mask.shape[0], k.fx, k.fy, k.cx - u0, k.cy - v0)
    core = cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    v, u = np.nonzero(core & (depth > 0))
    chosen = np.s_[:: 1 + len(u) // POINTS]
    z = depth[v, u][chosen].astype(float)
    points = directions(np.column_stack([u, v])[chosen], here) * z[:, None]
    edge = outline(mask, depth, stereo.baseline * k.fx)
    some = np.s_[:: 1 + len(edge.pixels) // EDGES]
    rays = directions(edge.pixels[some], here)
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    independent = len(u) / INDEPENDENT_AREA / max(1, len(points))
    sight = Sight(
        points,
        stereo.noise * z**2 + QUANTUM,
        rays,
        np.full(len(rays), EDGE_WIDTH / k.fx),
        edge.covered[some],
        min(1.0, independent),
        min(1.0, EDGE_SHARE * len(edge.pixels) / max(1, len(rays))),
    )
    return Patch(cut, depth, here, sight, int(np.count_nonzero(mask)))


def directions(pixels: NDArray[np.generic], k: Intrinsics) -> FloatArray:
    """Points (n, 3) at depth 1 on the rays of `pixels` (n, 2)."""
    u, v = np.asarray(pixels, float).T
    return np.column_stack([(u - k.cx) / k.fx, (v - k.cy) / k.fy, np.ones(len(u))])
