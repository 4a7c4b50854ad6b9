"""The connector in a colour image: HSV ranges and the largest contour (Hwang 2024, section 3.2.3.1)."""

import colorsys
from dataclasses import dataclass
from enum import StrEnum

import cv2
import numpy as np
from numpy.typing import NDArray

HUE_STEPS = 180  # OpenCV's 8-bit hue counts half degrees


class NotSeen(StrEnum):
    """Why an image gave no connector."""

    NO_COLOR = "no_color"  # no pixel of its colour
    TOO_SMALL = "too_small"  # its largest patch has too few pixels
    NO_CAMERA = "no_camera"  # the camera is not to be trusted
    NO_DEPTH = "no_depth"  # the patch has too few depth readings
    NOT_ITS_SHAPE = "not_its_shape"  # its colour, but not a cylinder of its size
    NO_TAG = "no_tag"  # its tag is not in sight
    WRONG_SIZE = "wrong_size"  # its tag's size in the image and the depth there disagree
    LOW_SCORE = "low_score"  # the network is not sure enough of any box


@dataclass(frozen=True)
class SegmentationParameters:
    """What counts as the connector's colour, in OpenCV's 8-bit HSV, and how its patch is cleaned.

    Light scales value and leaves hue and saturation alone, so value has a low floor and no ceiling: `for_color` derives
    the figures. `dilate` and `erode` count 3x3 passes: one closes gaps of two pixels, and as many erosions undo it.
    """

    hue: float
    hue_tolerance: float
    min_saturation: int
    min_value: int
    dilate: int = 1
    erode: int = 1
    min_area: int = 30  # pixels; choice: 2 % of the connector at 0.75 m, and more than noise gathers

    @classmethod
    def for_color(cls, color: tuple[float, float, float]) -> "SegmentationParameters":
        """Parameters for an RGB colour, each 0 to 1.

        Choices: hue +-8 (knowledge: red is h <= 8 or >= 172 of 180); at least half of the colour's saturation, for
        haze and glare; a fifth of its value, since full shadow leaves 0.45 of the light, 20 % less leaves 0.36, and a
        face turned away from an inexact light a little less.
        """
        hue, saturation, value = colorsys.rgb_to_hsv(*color)
        return cls(hue * HUE_STEPS, 8.0, round(255 * saturation / 2), round(255 * value / 5))

    def ranges(self) -> list[tuple[NDArray[np.uint8], NDArray[np.uint8]]]:
        """Lower and upper HSV corners; two pairs where the hue range passes through 0, as red's does."""
        low, high = round(self.hue - self.hue_tolerance), round(self.hue + self.hue_tolerance)
        spans = [(max(low, 0), min(high, HUE_STEPS - 1))]
        if low < 0:
            spans.append((low + HUE_STEPS, HUE_STEPS - 1))
        if high >= HUE_STEPS:
            spans.append((0, high - HUE_STEPS))
        floor = (self.min_saturation, self.min_value)
        return [(np.array([a, *floor], np.uint8), np.array([b, 255, 255], np.uint8)) for a, b in spans]


@dataclass(frozen=True, eq=False)
class Segment:
    """The connector's pixels: `mask` (H, W), its pixel count, and the box (u0, v0, u1, v1) that holds it, ends open."""

    mask: NDArray[np.bool_]
    area: int
    box: tuple[int, int, int, int]


@dataclass(frozen=True)
class NoSegment:
    """No connector in the image: a named reason and a sentence with the numbers."""

    reason: NotSeen
    message: str


def color_mask(rgb: NDArray[np.uint8], parameters: SegmentationParameters) -> NDArray[np.uint8]:
    """255 where the colour is the connector's, else 0; (H, W)."""
    hsv = cv2.cvtColor(rgb, cv2.COLOR_RGB2HSV)
    first, *others = (cv2.inRange(hsv, low, high) for low, high in parameters.ranges())
    for other in others:
        cv2.bitwise_or(first, other, dst=first)
    return np.asarray(first, np.uint8)


def segment(rgb: NDArray[np.uint8], parameters: SegmentationParameters) -> Segment | NoSegment:
    """The largest patch of the connector's colour in `rgb` (H, W, 3): mask, dilate, largest contour by area, erode."""
    binary = color_mask(rgb, parameters)
    kernel = np.ones((3, 3), np.uint8)
    dilated = cv2.dilate(binary, kernel, iterations=parameters.dilate)
    contours, _ = cv2.findContours(dilated, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not contours:
        return NoSegment(NotSeen.NO_COLOR, "no pixel has the connector's colour")
    largest = max(contours, key=cv2.contourArea)
    u, v, width, height = cv2.boundingRect(largest)
    # The contour fills holes; what was no colour before the dilation and after it stays out.
    patch = np.zeros((height, width), np.uint8)
    cv2.drawContours(patch, [largest], -1, 255, cv2.FILLED, offset=(-u, -v))
    cv2.bitwise_and(patch, dilated[v : v + height, u : u + width], dst=patch)
    patch = cv2.erode(patch, kernel, iterations=parameters.erode, borderType=cv2.BORDER_CONSTANT, borderValue=0)
    area = cv2.countNonZero(patch)
    if area < parameters.min_area:
        message = f"the largest patch of the connector's colour has {area} pixels, {parameters.min_area} are needed"
        return NoSegment(NotSeen.TOO_SMALL, message)
    mask = np.zeros(binary.shape, np.bool_)
    mask[v : v + height, u : u + width] = patch > 0
    return Segment(mask, area, (u, v, u + width, v + height))
