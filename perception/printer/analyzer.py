"""The image analyzer: where a target is in the picture of the hand's camera, by its colour."""

from collections.abc import Generator
from dataclasses import dataclass

import cv2
import numpy as np

from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.devices import Clock
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.printer.actions import Action, ImageFeedback, ImageGoal, Sighting, Target
from regrasp.interfaces.printer.cause import PrinterCause
from regrasp.interfaces.printer.cell import KnownPrinter
from regrasp.interfaces.request import RequestError
from regrasp.perception.camera.color import SegmentationParameters, color_mask
from regrasp.perception.service import Perception


@dataclass(frozen=True)
class AnalyzerParameters:
    """What counts as a target."""

    least_area: int = 100  # px in its colour; choice: the gripping section has 600 at 0.7 m


class ColorAnalyzer:
    """Implements `regrasp.interfaces.printer.actions.ImageAnalyzer` by the targets' hues; it knows no shapes.

    The largest connected blob of a target's colour is the target, and the rectangle about it is its box.
    """

    def __init__(
        self,
        perception: Perception,
        printer: KnownPrinter,
        clock: Clock,
        parameters: AnalyzerParameters = AnalyzerParameters(),
    ) -> None:
        self._perception, self._camera, self._clock = perception, printer.camera, clock
        self._colors: dict[Target, SegmentationParameters] = {
            "obj": SegmentationParameters.for_color(printer.part.color),
            "targ": SegmentationParameters.for_color(printer.part.section.color),
        }
        self._parameters = parameters
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
        """The target in a picture; None if it shows too little of it."""
        mask = color_mask(frame.rgb, self._colors[target])
        _, _, boxes, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
        blobs = boxes[1:]  # the first is all that has another colour
        if not len(blobs) or blobs[:, cv2.CC_STAT_AREA].max() < self._parameters.least_area:
            return None
        left, top, width, height, _ = blobs[np.argmax(blobs[:, cv2.CC_STAT_AREA])].tolist()
        rows, columns = mask.shape
        offset = left + 0.5 * (width - columns), top + 0.5 * (height - rows)
        return Sighting(offset, float(width * height), frame.stamp)
