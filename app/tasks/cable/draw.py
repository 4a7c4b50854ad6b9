"""A picture of a technique's result: the connector's silhouette, its axis, and the figures as text."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.app.run.video import PAPER, write_text
from regrasp.interfaces.frame import Intrinsics
from regrasp.perception.camera.model import project
from regrasp.perception.pose.estimate import Estimate

SILHOUETTE_COLOR, EDGE_COLOR, ARROW_COLOR = (90, 255, 90), (0, 40, 0), (255, 240, 60)  # RGB; bright, with dark edges
SUBPIXEL_BITS = 4  # of OpenCV's fixed-point coordinates
MAX_COORDINATE = 20_000.0  # px; what lies further off is not drawn: OpenCV's coordinates would overflow
_CIRCLE_ANGLES = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)  # rad


@dataclass(frozen=True)
class DrawingStyle:
    """Sizes in the drawn picture."""

    min_width: int = 640  # px; a smaller picture is enlarged, so that the text fits
    font_scale: float = 0.5  # of OpenCV's font
    letter_width: int = 9  # px at that scale
    line_height: int = 22  # px at that scale
    arrow_head: float = 0.12  # of its length; choice: inside the silhouette of a connector four times as long as thick


def draw_pose(
    rgb: NDArray[np.uint8],
    intrinsics: Intrinsics,
    found: tuple[Estimate, RigidTransform] | None,
    radius: float,
    length: float,
    lines: Sequence[str],
    style: DrawingStyle = DrawingStyle(),
) -> NDArray[np.uint8]:
    """A copy of `rgb` (H, W, 3), enlarged if small, with the `found` estimate and, below, `lines` of text.

    `found` is the estimate and camera_from_world. The silhouette is that of a cylinder of `radius` and `length` m, or
    of the visible length where not the whole is visible. The arrow points from the cable's end to the tip; it has two
    heads where the frame does not tell them apart.
    """
    scale = max(1, -(-style.min_width // rgb.shape[1]))
    image = cv2.resize(rgb, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC) if scale > 1 else rgb.copy()
    if found is not None:
        estimate, camera_from_world = found
        half = 0.5 * (length if estimate.whole else estimate.extent)
        center, axis = camera_from_world.apply(estimate.position), camera_from_world.rotation.apply(estimate.axis)
        _draw_silhouette(image, scale, intrinsics, _end_circles(center, axis, half, radius))
        ends = np.array([center - half * axis, center + half * axis])
        head = style.arrow_head
        _draw_arrow(image, scale, intrinsics, ends, head, both_ways=not estimate.sign_seen)
    return np.vstack([image, _text_band(lines, image.shape[1], style)])


def _text_band(lines: Sequence[str], width: int, style: DrawingStyle) -> NDArray[np.uint8]:
    """The text below the picture, where it hides nothing: (h, width, 3)."""
    wrapped = [part for line in lines for part in textwrap.wrap(line, width // style.letter_width - 2)]
    band = np.full((style.line_height * len(wrapped) + 12, width, 3), PAPER, np.uint8)
    for row, line in enumerate(wrapped):
        write_text(band, line, (10, 20 + style.line_height * row), style.font_scale)
    return band


def _end_circles(
    center: NDArray[np.float64], axis: NDArray[np.float64], half: float, radius: float
) -> NDArray[np.float64]:
    """Points (n, 3) m on the circles at both ends: the convex hull of their images is the cylinder's silhouette."""
    across = np.linalg.svd(axis[None])[2][1:]
    circle = radius * np.column_stack([np.cos(_CIRCLE_ANGLES), np.sin(_CIRCLE_ANGLES)]) @ across
    return np.concatenate([center - half * axis + circle, center + half * axis + circle])


def _pixels(points: NDArray[np.float64], intrinsics: Intrinsics, scale: int) -> NDArray[np.int32] | None:
    """Fixed-point pixels (n, 2) of the enlarged picture; None where some cannot be drawn."""
    pixels = (project(points, intrinsics) + 0.5) * scale - 0.5
    if not np.all(np.abs(pixels) < MAX_COORDINATE):  # NaN too
        return None
    return np.rint(pixels * 2**SUBPIXEL_BITS).astype(np.int32)


def _draw_silhouette(
    image: NDArray[np.uint8], scale: int, intrinsics: Intrinsics, circles: NDArray[np.float64]
) -> None:
    pixels = _pixels(circles, intrinsics, scale)
    if pixels is not None:
        hull = [cv2.convexHull(pixels)]
        cv2.polylines(image, hull, True, EDGE_COLOR, 3, cv2.LINE_AA, SUBPIXEL_BITS)
        cv2.polylines(image, hull, True, SILHOUETTE_COLOR, 1, cv2.LINE_AA, SUBPIXEL_BITS)


def _draw_arrow(
    image: NDArray[np.uint8],
    scale: int,
    intrinsics: Intrinsics,
    ends: NDArray[np.float64],
    head: float,
    both_ways: bool,
) -> None:
    pixels = _pixels(ends, intrinsics, scale)
    if pixels is not None:
        start, tip = pixels.tolist()
        for color, thickness in ((EDGE_COLOR, 4), (ARROW_COLOR, 2)):
            cv2.arrowedLine(image, start, tip, color, thickness, cv2.LINE_AA, SUBPIXEL_BITS, head)
            if both_ways:
                cv2.arrowedLine(image, tip, start, color, thickness, cv2.LINE_AA, SUBPIXEL_BITS, head)
