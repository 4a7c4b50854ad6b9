"""The connector in a colour image: HSV ranges and the largest contour (Hwang 2024, section 3.2.3.1)."""

from dataclasses import dataclass

import cv2
import numpy as np

from regrasp.interfaces.arrays import ColorImage, Mask
from regrasp.interfaces.cable.sight import NotSeen as NotSeen
from regrasp.perception.camera.color import SegmentationParameters, color_mask


@dataclass(frozen=True, eq=False)
class Segment:
    """The connector's pixels."""

    area: int  # number of pixels
    corner: tuple[int, int]  # first pixel (u, v) of the box around them
    mask: Mask  # (h, w), of the box


@dataclass(frozen=True)
class NoSegment:
    """No connector in the image: a named reason and a sentence with the numbers."""

    reason: NotSeen
    message: str


def segment(rgb: ColorImage, parameters: SegmentationParameters) -> Segment | NoSegment:
    """The largest blob of the connector's colour in `rgb` (H, W, 3): mask, dilate, largest contour by area, erode."""
    binary = color_mask(rgb, parameters)
    kernel = np.ones((3, 3), np.uint8)
    dilated = cv2.dilate(binary, kernel, iterations=parameters.dilate)
    contours, _ = cv2.findContours(dilated, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not contours:
        return NoSegment(NotSeen.NO_COLOR, "no pixel has the connector's colour")
    largest = max(contours, key=cv2.contourArea)
    u, v, width, height = cv2.boundingRect(largest)
    # The contour fills holes; the dilated mask takes them out again.
    blob = np.zeros((height, width), np.uint8)
    cv2.drawContours(blob, [largest], -1, 255, cv2.FILLED, offset=(-u, -v))
    cv2.bitwise_and(blob, dilated[v : v + height, u : u + width], dst=blob)
    blob = cv2.erode(blob, kernel, iterations=parameters.erode, borderType=cv2.BORDER_CONSTANT, borderValue=0)
    area = cv2.countNonZero(blob)
    if area < parameters.min_area:
        message = f"the largest blob of the connector's colour has {area} pixels, {parameters.min_area} are needed"
        return NoSegment(NotSeen.TOO_SMALL, message)
    return Segment(area, (u, v), blob > 0)
