"""The image analyzer: where a target is in the picture of the hand's camera (Mounesisohi 2022, section 4.2.8)."""

from collections.abc import Generator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.arrays import ColorImage
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.devices import Clock
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.outline import Outline
from regrasp.interfaces.printer.actions import Action, ImageFeedback, ImageGoal, PartClass, Sighting, Target
from regrasp.interfaces.printer.cause import PrinterCause
from regrasp.interfaces.printer.cell import KnownPrinter
from regrasp.interfaces.request import RequestError
from regrasp.perception.camera.color import SegmentationParameters, color_mask
from regrasp.perception.detection import PixelBox, corners, intersection_over_union
from regrasp.perception.printer.detector import PartDetector
from regrasp.perception.service import Perception

WORDS: dict[Target, str] = {"obj": "printed part", "targ": "gripping section"}


@dataclass(frozen=True)
class AnalyzerParameters:
    """What counts as a target."""

    grown: float = 0.25  # of a network's box, to each side, where the target's colour is looked for; choice
    min_overlap: float = 0.5  # of the box by colour with the network's, from which both show one thing; choice
    least_area: int = 100  # px in its colour; choice: the gripping section has 600 at 0.7 m


class PartFinder:
    """Finds a target in a picture by a network, or else by its colour.

    Of the network's boxes of the target's class the largest counts, as in the source. Its edges are off by 7 % of a
    box, so they are moved to the target's colour there. Where the network sees none, the largest connected blob of that
    colour in the whole picture is the target. The fingers' colour is not told: the network alone finds them.
    """

    def __init__(self, printer: KnownPrinter, parameters: AnalyzerParameters = AnalyzerParameters()) -> None:
        self._detector: PartDetector | None = None  # read when it is first asked
        self._colors: dict[PartClass, SegmentationParameters] = {
            "obj": SegmentationParameters.for_color(printer.part.color),
            "targ": SegmentationParameters.for_color(printer.part.section.color),
        }
        self._parameters = parameters

    def find(self, rgb: ColorImage, target: PartClass, stamp: float = 0.0) -> Sighting | None:
        """The target in a picture (H, W, 3) of the time `stamp`; None if it shows too little of it."""
        seen = self._by_network(rgb, target, stamp)
        return self._by_color(rgb, target, stamp) if seen is None else seen

    def _by_network(self, rgb: ColorImage, target: PartClass, stamp: float) -> Sighting | None:
        if self._detector is None:
            self._detector = PartDetector()
        found = [d for d in self._detector.detect(rgb) if d.name == target]
        if not found:
            return None
        largest = max(found, key=lambda d: d.area)
        return _sighting(rgb, stamp, self._refined(rgb, target, largest.box), largest.score)

    def _refined(self, rgb: ColorImage, target: PartClass, box: PixelBox) -> PixelBox:
        """The box round what has the target's colour there; the network's own where that is another thing."""
        if target not in self._colors:
            return box
        values, (rows, columns) = self._parameters, rgb.shape[:2]
        u, v = values.grown * (box[2] - box[0]), values.grown * (box[3] - box[1])
        left, top = max(int(box[0] - u), 0), max(int(box[1] - v), 0)
        right, bottom = min(int(box[2] + u) + 2, columns), min(int(box[3] + v) + 2, rows)
        found = _largest_blob(
            color_mask(np.ascontiguousarray(rgb[top:bottom, left:right]), self._colors[target]), values.least_area
        )
        if found is None:
            return box
        seen = (found[0] + left, found[1] + top, found[2] + left, found[3] + top)
        return seen if intersection_over_union(seen, box) >= values.min_overlap else box

    def _by_color(self, rgb: ColorImage, target: PartClass, stamp: float) -> Sighting | None:
        if target not in self._colors:
            return None
        box = _largest_blob(color_mask(rgb, self._colors[target]), self._parameters.least_area)
        return None if box is None else _sighting(rgb, stamp, box, None)


class PartAnalyzer:
    """Implements `regrasp.interfaces.printer.actions.ImageAnalyzer` by a `PartFinder` on fresh pictures."""

    def __init__(
        self,
        perception: Perception,
        printer: KnownPrinter,
        clock: Clock,
        parameters: AnalyzerParameters = AnalyzerParameters(),
    ) -> None:
        self._perception, self._camera, self._clock = perception, printer.camera, clock
        self._finder = PartFinder(printer, parameters)
        self._under_way: Action[ImageFeedback, Sighting] | None = None

    def send(self, goal: ImageGoal) -> Action[ImageFeedback, Sighting]:
        """See `Device`. It ends with TARGET_NOT_SEEN, or with CAMERA_FAILED where the camera is in trouble."""
        if not isinstance(goal, ImageGoal):
            raise TypeError(f"the image analyzer takes ImageGoal, not {type(goal).__name__}")
        if self._under_way is not None:
            self._under_way.preempt()
        looked_at: set[float] = set()  # the stamps of the pictures
        self._under_way = Action(self._steps(goal, looked_at), lambda: ImageFeedback(len(looked_at)), part="perception")
        return self._under_way

    def _steps(self, goal: ImageGoal, looked_at: set[float]) -> Generator[None, None, Sighting]:
        begin = self._clock.now()
        while self._clock.now() <= begin + goal.seconds + 1e-9:
            frame = self._perception.frame(self._camera)
            fresh = frame is not None and frame.stamp >= begin and frame.stamp not in looked_at
            if frame is not None and fresh and self._perception.trouble(self._camera) is None:
                looked_at.add(frame.stamp)
                if (found := self.find(frame, goal.target)) is not None:
                    return found
            yield
        why = f"{len(looked_at)} pictures of the {self._camera} camera in {goal.seconds:g} s did not show {goal.target}"
        if (trouble := self._perception.trouble(self._camera)) is not None:
            raise RequestError(CauseCode.CAMERA_FAILED, f"{why}: {trouble}")
        raise RequestError(PrinterCause.TARGET_NOT_SEEN, why)

    def find(self, frame: RgbdFrame, target: Target) -> Sighting | None:
        """The target in a frame; None if it shows too little of it."""
        found = self._finder.find(frame.rgb, target, frame.stamp)
        if found is not None:
            by = "its colour" if found.confidence is None else f"the network, {found.confidence:.2f}"
            self._perception.found(frame.camera, Outline(f"{WORDS[target]}, by {by}", frame.stamp, corners(found.box)))
        return found


def _largest_blob(mask: NDArray[np.uint8], least_area: int) -> PixelBox | None:
    """The box round the mask's largest connected blob; None if that has fewer than `least_area` px."""
    _, _, boxes, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    blobs = boxes[1:]  # the first is all that is not in the mask
    if not len(blobs) or blobs[:, cv2.CC_STAT_AREA].max() < least_area:
        return None
    left, top, width, height, _ = blobs[np.argmax(blobs[:, cv2.CC_STAT_AREA])].tolist()
    return left - 0.5, top - 0.5, left + width - 0.5, top + height - 0.5


def _sighting(rgb: ColorImage, stamp: float, box: PixelBox, confidence: float | None) -> Sighting:
    rows, columns = rgb.shape[:2]
    offset = 0.5 * (box[0] + box[2] + 1.0 - columns), 0.5 * (box[1] + box[3] + 1.0 - rows)
    return Sighting(offset, (box[2] - box[0]) * (box[3] - box[1]), stamp, box, confidence)
