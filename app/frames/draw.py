"""A picture of what a technique found: the connector's outline, its axis, and the figures in words."""

import textwrap
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.app.run.video import PAPER, write_text
from regrasp.interfaces.frame import Intrinsics
from regrasp.perception.camera.model import project
from regrasp.perception.pose.estimate import Estimate

FloatArray = NDArray[np.float64]

LEAST_WIDTH = 640  # pixels; a smaller picture is enlarged, so that the words fit
LETTERS, LETTER, LINE = 0.5, 9, 22  # OpenCV's size of the letters; pixels of a letter's width and a line's height
BRIGHT, DARK, ARROW = (90, 255, 90), (0, 40, 0), (255, 240, 60)  # RGB; choice: bright in dark edging shows on anything
ON_RIM = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)  # rad: points of an end's circle
FINE = 4  # bits of a pixel's fraction
HEAD = 0.12  # of the arrow's length; choice: within the outline of a connector four times as long as thick
BEYOND = 20_000.0  # pixels; what is further off is not drawn


def draw_pose(
    rgb: NDArray[np.uint8],
    intrinsics: Intrinsics,
    found: tuple[Estimate, RigidTransform] | None,
    radius: float,
    length: float,
    lines: Sequence[str],
) -> NDArray[np.uint8]:
    """A copy of `rgb` (H, W, 3), enlarged if small, with `lines` and what was `found`: estimate, camera_from_world.

    The outline is that of a cylinder of `radius` and `length` m, as long as the visible part where that is not the
    whole; the arrow leads from the cable's end to the tip, and both ways where the frame does not tell.
    """
    scale = max(1, -(-LEAST_WIDTH // rgb.shape[1]))
    image = cv2.resize(rgb, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC) if scale > 1 else rgb.copy()
    if found is not None:
        estimate, camera_from_world = found
        half = 0.5 * (length if estimate.whole else estimate.extent)
        center, axis = camera_from_world.apply(estimate.position), camera_from_world.rotation.apply(estimate.axis)
        rims = _rims(center, axis, half, radius)
        _outline(image, scale, intrinsics, rims)
        ends = np.array([center - half * axis, center + half * axis])
        _arrow(image, scale, intrinsics, ends, both_ways=not estimate.sign_seen)
    return np.vstack([image, _band(lines, image.shape[1])])


def _band(lines: Sequence[str], width: int) -> NDArray[np.uint8]:
    """The words below the picture, where they hide nothing of it: (h, width, 3)."""
    wrapped = [part for line in lines for part in textwrap.wrap(line, width // LETTER - 2)]
    band = np.full((LINE * len(wrapped) + 12, width, 3), PAPER, np.uint8)
    for row, line in enumerate(wrapped):
        write_text(band, line, (10, 20 + LINE * row), LETTERS)
    return band


def _rims(center: FloatArray, axis: FloatArray, half: float, radius: float) -> FloatArray:
    """Points (n, 3) m of the two ends' circles: the hull of their images is the cylinder's outline."""
    across = np.linalg.svd(axis[None])[2][1:]
    circle = radius * np.column_stack([np.cos(ON_RIM), np.sin(ON_RIM)]) @ across
    return np.concatenate([center - half * axis + circle, center + half * axis + circle])


def _pixels(points: FloatArray, intrinsics: Intrinsics, scale: int) -> NDArray[np.int32] | None:
    """Pixels (n, 2) of the enlarged picture, `FINE` bits of them fraction; None where some cannot be drawn."""
    pixels = (project(points, intrinsics) + 0.5) * scale - 0.5
    if not np.all(np.abs(pixels) < BEYOND):  # NaN too
        return None
    return np.rint(pixels * 2**FINE).astype(np.int32)


def _outline(image: NDArray[np.uint8], scale: int, intrinsics: Intrinsics, rims: FloatArray) -> None:
    pixels = _pixels(rims, intrinsics, scale)
    if pixels is not None:
        hull = [cv2.convexHull(pixels)]
        cv2.polylines(image, hull, True, DARK, 3, cv2.LINE_AA, FINE)
        cv2.polylines(image, hull, True, BRIGHT, 1, cv2.LINE_AA, FINE)


def _arrow(image: NDArray[np.uint8], scale: int, intrinsics: Intrinsics, ends: FloatArray, both_ways: bool) -> None:
    pixels = _pixels(ends, intrinsics, scale)
    if pixels is not None:
        start, tip = pixels.tolist()
        for color, thickness in ((DARK, 4), (ARROW, 2)):
            cv2.arrowedLine(image, start, tip, color, thickness, cv2.LINE_AA, FINE, HEAD)
            if both_ways:
                cv2.arrowedLine(image, tip, start, color, thickness, cv2.LINE_AA, FINE, HEAD)
