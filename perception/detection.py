"""What our detectors share: the network's picture, and the boxes that its maps tell (CenterNet, Zhou et al. 2019)."""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.arrays import ColorImage, FloatArray

PixelBox = tuple[float, float, float, float]  # (u0, v0, u1, v1) px

STRIDE = 8  # px of the network's picture that a cell of its output covers; a change needs a new training


def letterboxed(
    image: NDArray[Any], shape: tuple[int, int], interpolation: int = cv2.INTER_AREA
) -> tuple[NDArray[Any], float]:
    """An image (H, W, ...) resized to fit into `shape` (h, w), zero beside it: (h, w, ...), and the factor."""
    height, width = image.shape[:2]
    scale = min(shape[1] / width, shape[0] / height)
    size = max(1, round(scale * width)), max(1, round(scale * height))
    canvas = np.zeros((*shape, *image.shape[2:]), image.dtype)
    cv2.resize(image, size, dst=canvas[: size[1], : size[0]], interpolation=interpolation)
    return canvas, scale


def four_pixels_one(image: ColorImage, out: NDArray[np.float32]) -> None:
    """Write `image` (h, w, 3) RGB to `out` (12, h / 2, w / 2), the first layer of a network's input.

    Each 2x2 block of pixels becomes one: channels 0 to 2 are red, green, blue (0 to 1) of the upper left pixel, then
    follow those of the upper right, lower left and lower right one. OpenCV takes a seventh less time for a whole
    network than with the same pixels side by side.
    """
    _, height, width = out.shape
    apart = image.reshape(height, 2, width, 2, 3).transpose(1, 3, 4, 0, 2)
    np.multiply(apart, np.float32(1 / 255), out=out.reshape(2, 2, 3, height, width))


def peaks(
    likelihood: NDArray[np.float32],
    box_maps: NDArray[np.float32],
    scale: float,
    min_score: float,
    max_overlap: float,
    max_detections: int,
) -> tuple[NDArray[np.intp], NDArray[np.intp], FloatArray, list[PixelBox]]:
    """Rows, columns, scores and boxes (n,) of what one class's maps tell, the likeliest first.

    `likelihood` (h, w). `box_maps` (4, h, w): offset of the box's centre from the cell's (u, v, cells), and logarithm
    of its edges (u, v, cells). `scale` is the factor by which the network's picture is smaller than the camera's. Of
    boxes on one thing, which overlap by more than `max_overlap`, only the likeliest stays.
    """
    rows, columns = np.nonzero(likelihood >= min_score)
    scores = likelihood[rows, columns].astype(float)
    if not len(rows):
        return rows, columns, scores, []
    du, dv, log_width, log_height = box_maps[:, rows, columns].astype(float)
    cell = STRIDE / scale
    centers = cell * np.column_stack([columns + 0.5 + du, rows + 0.5 + dv]) - 0.5
    edges = cell * np.exp(np.clip(np.column_stack([log_width, log_height]), -4, 6))
    boxes = np.hstack([centers - edges / 2, centers + edges / 2])
    # CenterNet reads only the peaks of the likelihood; a cell beside one may have a better box, if something crosses.
    corners = np.hstack([centers - edges / 2, edges]).tolist()
    kept = np.array(cv2.dnn.NMSBoxes(corners, scores.tolist(), 0.0, max_overlap)[:max_detections], int)
    return rows[kept], columns[kept], scores[kept], [tuple(box) for box in boxes[kept].tolist()]


def clipped(box: PixelBox, shape: tuple[int, ...]) -> PixelBox:
    """What of a box lies in a picture of `shape` (H, W) px, whose pixel u covers u - 0.5 to u + 0.5."""
    low, (v_most, u_most) = -0.5, (edge - 0.5 for edge in shape)
    u0, u1 = (min(max(u, low), u_most) for u in box[::2])
    v0, v1 = (min(max(v, low), v_most) for v in box[1::2])
    return u0, v0, u1, v1


def corners(box: PixelBox) -> FloatArray:
    """The box's corners (4, 2) px, in their order round it."""
    u0, v0, u1, v1 = box
    return np.array([(u0, v0), (u1, v0), (u1, v1), (u0, v1)])


def intersection_over_union(a: PixelBox, b: PixelBox) -> float:
    """Shared area over joint area of two boxes; 0 for two without area."""
    across, down = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
    shared = max(0.0, across) * max(0.0, down)
    union = (a[2] - a[0]) * (a[3] - a[1]) + (b[2] - b[0]) * (b[3] - b[1]) - shared
    return shared / union if union > 0 else 0.0
