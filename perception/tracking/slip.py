"""Has the connector left the hand? The thesis's distance test (Hwang 2024, section 3.4.1), and the fingers' own."""

from collections import deque
from dataclasses import dataclass
from typing import Literal

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.reading import GripperReading


@dataclass(frozen=True)
class SlipEvidence:
    """The result of one test: the measured `value` (m), the `limit` (m) for it, and a sentence with both."""

    detected: bool
    by: Literal["distance", "gap", "place"]
    value: float
    limit: float
    sentence: str


def distance_slip(gripper: FloatArray, connector: FloatArray, limit: float = 0.2) -> SlipEvidence:
    """Whether the `connector`'s estimated position (3,) is further than `limit` m from the `gripper`'s centre (3,).

    The default is the thesis's (section 3.4.1).
    """
    value = float(np.linalg.norm(connector - gripper))
    sentence = f"connector {value:.3f} m from the gripper's centre, limit {limit:.3f} m"
    return SlipEvidence(value > limit, "distance", value, limit, sentence)


def seen_at(connector: FloatArray, point: FloatArray, radius: float) -> SlipEvidence:
    """Whether the `connector`'s estimated position (3,) is within `radius` m of a `point` (3,), as a clip's seat."""
    value = float(np.linalg.norm(connector - point))
    sentence = f"connector {value:.3f} m from the place looked at, limit {radius:.3f} m"
    return SlipEvidence(value <= radius, "place", value, radius, sentence)


@dataclass(frozen=True)
class GapParameters:
    """What the gap between the finger pads may be while they hold a thing."""

    tolerance: float = 0.003  # m below its thickness; choice: backlash 1 mm, 5 sigma of the median 1 mm, pads give 1 mm
    readings: int = 5  # choice: 50 ms at 100 Hz; the median of five has 0.54 of one reading's deviation


class GapTest:
    """Whether the finger pads are as far apart as the held thing asks for, by the median gap of the last readings.

    Closer than its thickness, they closed on nothing; further than twice its thickness, the jaw stands open. In between
    a stiff cable may push the pads apart when it tilts.
    """

    def __init__(self, thickness: float, parameters: GapParameters = GapParameters()) -> None:
        """`thickness` of the held thing, metres."""
        self._closed = thickness - parameters.tolerance
        self._open = 2 * thickness
        self._gaps: deque[GripperReading] = deque(maxlen=parameters.readings)

    def feed(self, reading: GripperReading) -> None:
        """Take in a reading; one that is not newer than the last is ignored."""
        if not self._gaps or reading.stamp > self._gaps[-1].stamp:
            self._gaps.append(reading)

    def reset(self) -> None:
        """Forget the readings, as when the jaw opens on purpose."""
        self._gaps.clear()

    def evidence(self) -> SlipEvidence:
        """The result so far; nothing is detected until there are enough readings."""
        if len(self._gaps) < (self._gaps.maxlen or 1):
            sentence = f"{len(self._gaps)} of {self._gaps.maxlen} finger readings so far"
            return SlipEvidence(False, "gap", float("nan"), self._closed, sentence)
        value = float(np.median([reading.gap for reading in self._gaps]))
        limit = self._open if value > self._open else self._closed
        sentence = f"pads {1e3 * value:.1f} mm apart, limit {1e3 * limit:.1f} mm"
        return SlipEvidence(not self._closed <= value <= self._open, "gap", value, limit, sentence)
