"""The same picture as PNG, drawn with OpenCV at twice its size."""

import cv2
import numpy as np
from numpy.typing import NDArray

from regrasp.trees.export.picture import picture
from regrasp.trees.export.shapes import Curve, Drawing, Lines, Rect, Shape, Text
from regrasp.trees.export.themes import Theme
from regrasp.trees.graph import Node

_SHIFT = 4  # fractional bits of OpenCV's fixed-point coordinates


def to_png(root: Node, theme: Theme) -> bytes:
    """The picture of the tree."""
    image = _drawn(picture(root, theme))
    return bytes(cv2.imencode(".png", image, [cv2.IMWRITE_PNG_COMPRESSION, 6])[1])  # half of what it makes by default


def _drawn(drawing: Drawing, max_pixels: float = 60e6) -> NDArray[np.uint8]:
    """The image (H, W, 3), BGR, at twice the size, or smaller where that exceeds `max_pixels`."""
    scale = min(2.0, float(np.sqrt(max_pixels / (drawing.width * drawing.height))))
    shape = (int(np.ceil(drawing.height * scale)), int(np.ceil(drawing.width * scale)), 3)
    image = np.full(shape, _bgr(drawing.background), np.uint8)
    font = cv2.FontFace("sans")
    for group in drawing.groups:
        for item in group.shapes:
            _draw(image, item, scale, font)
    return image


def _draw(image: NDArray[np.uint8], shape: Shape, scale: float, font: cv2.FontFace) -> None:
    if isinstance(shape, Text):
        place = (round(shape.x * scale), round(shape.y * scale))
        weight = 600 if shape.bold else 400
        cv2.putText(image, shape.text, place, _bgr(shape.colour), font, round(shape.size * scale), weight)
        return
    closed = isinstance(shape, Rect)
    points = _corner_points(shape) if isinstance(shape, Rect) else _path(shape)
    fixed = [np.round(points * scale * 2**_SHIFT).astype(np.int32)]
    if isinstance(shape, Rect):
        cv2.fillPoly(image, fixed, _bgr(shape.fill), cv2.LINE_AA, _SHIFT)
    if shape.stroke_width:
        width = max(1, round(shape.stroke_width * scale - 0.7))  # OpenCV smooths outward
        cv2.polylines(image, fixed, closed, _bgr(shape.stroke), width, cv2.LINE_AA, _SHIFT)


def _corner_points(rect: Rect) -> NDArray[np.float64]:
    """Points (n, 2) px along a rectangle with round corners."""
    r = min(rect.radius, rect.width / 2, rect.height / 2)
    turn = np.linspace(0.0, np.pi / 2, 12)
    corners = []
    for i, (x, y) in enumerate(((1, 1), (0, 1), (0, 0), (1, 0))):
        center = (rect.x + (rect.width - r if x else r), rect.y + (rect.height - r if y else r))
        angle = turn + i * np.pi / 2
        corners.append(np.stack([center[0] + r * np.cos(angle), center[1] + r * np.sin(angle)], axis=1))
    return np.concatenate(corners)


def _path(shape: Curve | Lines) -> NDArray[np.float64]:
    points = np.asarray(shape.points)
    if isinstance(shape, Lines):
        return points
    t = np.linspace(0.0, 1.0, 24)[:, None]
    weights = np.concatenate([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3], axis=1)
    return np.asarray(weights @ points, np.float64)


def _bgr(colour: str) -> tuple[int, int, int]:
    return int(colour[5:7], 16), int(colour[3:5], 16), int(colour[1:3], 16)
