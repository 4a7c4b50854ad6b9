"""Looking for some seconds: one result a frame, and on the way the obstacles."""

from collections.abc import Callable, Generator
from typing import Protocol

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.sight import Estimate, NoEstimate, Sightings
from regrasp.interfaces.devices import Clock
from regrasp.interfaces.request import Request


class Eyes(Protocol):
    """What is asked of a perception service; see `CablePerception`."""

    def look(self, camera: str) -> Estimate | NoEstimate | None:
        """The connector's pose by the newest frame."""
        ...

    def trouble(self, camera: str) -> str | None:
        """Why a camera is not to be trusted now."""
        ...

    def map_obstacles(self, camera: str) -> int:
        """Take the newest frame into the map."""
        ...


class FrameRule:
    """Which frames count in a look that begins now: those exposed from a moment on, each once."""

    def __init__(self, now: float, seconds: float, settle: float, later: bool) -> None:
        """See `watched`."""
        self.end = now + settle + seconds
        # `later` measures back from the end. The sum's rounding may let a frame of the very first moment in.
        self._since = float(np.nextafter(self.end - seconds, np.inf)) if later else now + settle
        self._stamps: set[float] = set()

    def counts(self, result: Estimate | NoEstimate) -> bool:
        """Whether this result does; the next one of its frame does not."""
        if result.stamp < self._since or result.stamp in self._stamps:
            return False
        self._stamps.add(result.stamp)
        return True

    @property
    def frames(self) -> int:
        """How many counted so far."""
        return len(self._stamps)


def watched(
    eyes: Eyes,
    clock: Clock,
    camera: str,
    rule: FrameRule,
    on_mapped: Callable[[], None] | None = None,
    frames_before_mapping: int = 3,
) -> Request[Sightings]:
    """Look through a camera at every tick, from the next on, until the `rule` ends.

    With `on_mapped` the obstacles before the camera are mapped at the frame of that number, if the camera is trusted
    then, and this is called.
    """

    def steps() -> Generator[None, None, Sightings]:
        estimates: list[Estimate] = []
        weak_detections: list[FloatArray] = []
        while clock.now() < rule.end - 1e-9:
            yield
            result = eyes.look(camera)
            if result is None or not rule.counts(result):
                continue
            if on_mapped is not None and rule.frames == frames_before_mapping and eyes.trouble(camera) is None:
                eyes.map_obstacles(camera)
                on_mapped()
            if isinstance(result, Estimate):
                estimates.append(result)
            elif result.weak_detection is not None:
                weak_detections.append(result.weak_detection)
        return Sightings(estimates, weak_detections)

    return Request(steps(), part="perception")
