"""A range of colours, and where in a picture they are."""

import colorsys
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.arrays import ColorImage

HUE_STEPS, BLUE_HUE = 180, 120  # OpenCV's 8-bit hue counts half degrees


@dataclass(frozen=True)
class SegmentationParameters:
    """What counts as a thing's colour, in OpenCV's 8-bit HSV, and how its blob is cleaned.

    The amount of light scales value and leaves hue and saturation alone, so value has a low floor and no ceiling. See
    `for_color`.
    """

    hue: float  # 0 to 180
    hue_tolerance: float  # to either side
    min_saturation: int  # of 255
    min_value: int  # of 255
    dilate: int = 1  # passes with a 3x3 kernel; one closes gaps of two pixels
    erode: int = 1  # passes; as many as dilations undo their growth
    min_area: int = 30  # pixels; choice: 2 % of a connector at 0.75 m, and more than noise gathers

    @classmethod
    def for_color(cls, color: tuple[float, float, float], hue_tolerance: float = 8.0) -> "SegmentationParameters":
        """Parameters for an RGB colour, each 0 to 1.

        Choices: hue +-8, since red is h <= 8 or >= 172 of 180; at least half of the colour's saturation, for haze and
        glare; a fifth of its value, since full shadow leaves 0.45 of the light, 20 % less light leaves 0.36 of it, and
        a face turned away from the light a little less.
        """
        hue, saturation, value = colorsys.rgb_to_hsv(*color)
        return cls(hue * HUE_STEPS, hue_tolerance, round(255 * saturation / 2), round(255 * value / 5))

    def range(self) -> tuple[int, NDArray[np.uint8], NDArray[np.uint8]]:
        """OpenCV's code that converts an RGB image to HSV, and the lower and upper limit (3,) of the colour there.

        Where the range of hues would pass through 0, as red's does, the code exchanges red and blue: this turns hue h
        into 120 - h, and the range is in one piece.
        """
        code, low, high = cv2.COLOR_RGB2HSV, round(self.hue - self.hue_tolerance), round(self.hue + self.hue_tolerance)
        if low < 0 or high >= HUE_STEPS:
            code, low, high = cv2.COLOR_BGR2HSV, (BLUE_HUE - high) % HUE_STEPS, (BLUE_HUE - low) % HUE_STEPS
        floor = (self.min_saturation, self.min_value)
        return code, np.array([low, *floor], np.uint8), np.array([high, 255, 255], np.uint8)


def color_mask(rgb: ColorImage, parameters: SegmentationParameters) -> NDArray[np.uint8]:
    """255 where the colour is in the range, else 0; (H, W)."""
    code, low, high = parameters.range()
    return np.asarray(cv2.inRange(cv2.cvtColor(rgb, code), low, high), np.uint8)
