"""Finds the printed part, its gripping section and the fingers in a picture of the hand's camera by a network.

The source has a YOLOv4 in its place (Mounesisohi 2022, section 4.2.8). Ours is a CenterNet (Zhou et al. 2019) with maps
of its own for each class. `regrasp train-part-detector` makes the file.
"""

from dataclasses import dataclass, replace
from importlib.resources import files

import cv2
import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.arrays import ColorImage
from regrasp.interfaces.printer.actions import CLASSES, PartClass
from regrasp.perception.detection import STRIDE, PixelBox, clipped, four_pixels_one, letterboxed, peaks

# The format of the network's input and output. A change needs a new training.
NETWORK_SHAPE = 320, 416  # px, height and width of its picture: 4:3, and as wide as the source's
NETWORK_INPUT = "four_pixels_one"  # name in the file; OpenCV checks an input's name, not its shape
CELLS = NETWORK_SHAPE[0] // STRIDE, NETWORK_SHAPE[1] // STRIDE
BOX_MAPS = 4  # of each class, see `peaks`
MIRRORED = [CLASSES.index({"lgrip": "rgrip", "rgrip": "lgrip"}.get(name, name)) for name in CLASSES]


@dataclass(frozen=True)
class PartDetectorParameters:
    """Which boxes count."""

    min_score: float = 0.5  # the source's
    max_overlap: float = 0.3  # intersection over union from which two boxes are one; the source's
    max_detections: int = 10  # of a class; choice: more than a cell holds


@dataclass(frozen=True)
class PartDetection:
    """One thing in a picture. `score` is 0 to 1; `box` lies on edges of pixels: pixel u covers u - 0.5 to u + 0.5."""

    name: PartClass
    score: float
    box: PixelBox

    @property
    def area(self) -> float:
        """The box's area, px2."""
        return (self.box[2] - self.box[0]) * (self.box[3] - self.box[1])


class PartDetector:
    """The network, read from an ONNX file; None takes the shipped one.

    Raises cv2.error if `model` is no such file.
    """

    def __init__(
        self, model: bytes | None = None, parameters: PartDetectorParameters = PartDetectorParameters()
    ) -> None:
        data = shipped_network() if model is None else model
        self._net = cv2.dnn.readNetFromONNX(np.frombuffer(data, np.uint8))
        self._parameters = parameters

    def detect(self, rgb: ColorImage, min_score: float | None = None) -> list[PartDetection]:
        """What a picture (H, W, 3) shows, the likeliest first. `min_score` overrides the parameters' own.

        The network sees the picture and its mirror image, and the mean of both answers counts. A box ends at the
        picture's edge, since a thing is learned by what the picture shows of it.

        Raises:
            ValueError: the network is none of ours.
        """
        image, scale = letterboxed(rgb, NETWORK_SHAPE)
        maps = 0.5 * (self._maps(image) + mirrored(self._maps(image[:, ::-1])))
        least = self._parameters.min_score if min_score is None else min_score
        found = decode(maps, scale, least, self._parameters)
        return [replace(each, box=clipped(each.box, rgb.shape[:2])) for each in found]

    def _maps(self, image: ColorImage) -> NDArray[np.float32]:
        """The network's output (20, 40, 52) for its picture (320, 416, 3) RGB."""
        self._net.setInput(network_input(image)[None], NETWORK_INPUT)
        maps = self._net.forward()
        if maps.shape != (1, len(CLASSES) * (1 + BOX_MAPS), *CELLS):
            raise ValueError(f"a network that answers with maps of shape {maps.shape} is none of ours")
        return np.array(maps[0])  # the next pass writes into its own


def mirrored(maps: NDArray[np.float32]) -> NDArray[np.float32]:
    """What the network's output (20, h, w) is for the mirror image: left is right, of the fingers, too."""
    likelihoods, boxes = maps[: len(CLASSES), :, ::-1], maps[len(CLASSES) :, :, ::-1]
    boxes = boxes.reshape(len(CLASSES), BOX_MAPS, *maps.shape[1:]) * np.array([-1, 1, 1, 1], np.float32)[:, None, None]
    return np.concatenate([likelihoods[MIRRORED], boxes[MIRRORED].reshape(-1, *maps.shape[1:])])


def shipped_network() -> bytes:
    """The ONNX file that comes with Regrasp."""
    return files("regrasp.perception.printer").joinpath("part_detector.onnx").read_bytes()


def network_input(image: ColorImage) -> NDArray[np.float32]:
    """The network's input (12, 160, 208) from its picture (320, 416, 3) RGB."""
    out = np.empty((12, NETWORK_SHAPE[0] // 2, NETWORK_SHAPE[1] // 2), np.float32)
    four_pixels_one(image, out)
    return out


def decode(
    maps: NDArray[np.float32],
    scale: float,
    min_score: float,
    parameters: PartDetectorParameters = PartDetectorParameters(),
) -> list[PartDetection]:
    """Detections from the network's output (20, 40, 52): the classes' likelihoods, then the box maps of each."""
    found = []
    for i, name in enumerate(CLASSES):
        first = len(CLASSES) + BOX_MAPS * i
        limits = min_score, parameters.max_overlap, parameters.max_detections
        _, _, scores, boxes = peaks(maps[i], maps[first : first + BOX_MAPS], scale, *limits)
        found += [PartDetection(name, score, box) for score, box in zip(scores.tolist(), boxes, strict=True)]
    return sorted(found, key=lambda d: -d.score)
