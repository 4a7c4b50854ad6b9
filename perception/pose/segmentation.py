"""The connector in a colour image: HSV ranges and the largest contour (Hwang 2024, section 3.2.3.1)."""

import colorsys
from dataclasses import dataclass
from enum import StrEnum

import cv2
import numpy as np
from numpy.typing import NDArray

HUE_STEPS, BLUE = 180, 120  # OpenCV's 8-bit hue counts half degrees


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

    def range(self) -> tuple[int, NDArray[np.uint8], NDArray[np.uint8]]:
        """OpenCV's code for the change of an RGB image to HSV, and the lower and upper corner (3,) in it.

        Where the range of hues would pass through 0, as red's does, the code is the one that takes red for blue: there
        hue h is 120 - h, and the range is whole.
        """
        code, low, high = cv2.COLOR_RGB2HSV, round(self.hue - self.hue_tolerance), round(self.hue + self.hue_tolerance)
        if low < 0 or high >= HUE_STEPS:
            code, low, high = cv2.COLOR_BGR2HSV, (BLUE - high) % HUE_STEPS, (BLUE - low) % HUE_STEPS
        floor = (self.min_saturation, self.min_value)
        return code, np.array([low, *floor], np.uint8), np.array([high, 255, 255], np.uint8)


@dataclass(frozen=True, eq=False)
class Segment:
    """The connector's pixels: their number, the first pixel (u, v) of the box that holds them, a `mask` of the box."""

    area: int
    corner: tuple[int, int]
    mask: NDArray[np.bool_]


@dataclass(frozen=True)
class NoSegment:
    """No connector in the image: a named reason and a sentence with the numbers."""

    reason: NotSeen
    message: str


def color_mask(rgb: NDArray[np.uint8], parameters: SegmentationParameters) -> NDArray[np.uint8]:
    """255 where the colour is the connector's, else 0; (H, W)."""
    code, low, high = parameters.range()
    return np.asarray(cv2.inRange(cv2.cvtColor(rgb, code), low, high), np.uint8)


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
    return Segment(area, (u, v), patch > 0)
