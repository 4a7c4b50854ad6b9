"""Has the connector left the hand? The thesis's distance test (Hwang 2024, section 3.4.1), and the fingers' own."""

from collections import deque
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.reading import GripperReading

DISTANCE_LIMIT = 0.2  # metres, section 3.4.1
GAP_TOLERANCE = 0.003  # metres; choice: backlash 1 mm, 5 sigma of the median 1 mm, give of the rubber pads 1 mm
GAP_READINGS = 5  # choice: 50 ms at 100 Hz; the median of five has 0.54 of one reading's deviation


@dataclass(frozen=True)
class SlipEvidence:
    """One test's word: what was measured (m), the limit (m) it was held against, and a sentence with both."""

    detected: bool
    by: Literal["distance", "gap", "place"]
    value: float
    limit: float
    sentence: str


def distance_slip(
    gripper: NDArray[np.float64], connector: NDArray[np.float64], limit: float = DISTANCE_LIMIT
) -> SlipEvidence:
    """Whether the `connector`'s estimated position (3,) is further than `limit` m from the `gripper`'s centre (3,)."""
    value = float(np.linalg.norm(connector - gripper))
    sentence = f"connector {value:.3f} m from the gripper's centre, limit {limit:.3f} m"
    return SlipEvidence(value > limit, "distance", value, limit, sentence)


def seen_at(connector: NDArray[np.float64], point: NDArray[np.float64], radius: float) -> SlipEvidence:
    """Whether the `connector`'s estimated position (3,) is within `radius` m of `point` (3,), the clip's seat say."""
    value = float(np.linalg.norm(connector - point))
    sentence = f"connector {value:.3f} m from the place looked at, limit {radius:.3f} m"
    return SlipEvidence(value <= radius, "place", value, radius, sentence)


class GapTest:
    """Whether the pads stand as what they should hold allows: the median gap of the last readings.

    Closer than it is thick, and they closed on nothing; twice as far, and the jaw stands open. In between a stiff cable
    may pry them by its tilt.
    """

    def __init__(self, thickness: float, tolerance: float = GAP_TOLERANCE, readings: int = GAP_READINGS) -> None:
        """`thickness` of the held thing and `tolerance` below it, metres; one noisy reading moves no median."""
        self._limit = thickness - tolerance
        self._open = 2 * thickness
        self._gaps: deque[GripperReading] = deque(maxlen=readings)

    def feed(self, reading: GripperReading) -> None:
        """Take in a reading; one that is not newer than the last is ignored."""
        if not self._gaps or reading.stamp > self._gaps[-1].stamp:
            self._gaps.append(reading)

    def reset(self) -> None:
        """Forget the readings, as when the jaw opens on purpose."""
        self._gaps.clear()

    def evidence(self) -> SlipEvidence:
        """The verdict; not detected until enough readings came."""
        if len(self._gaps) < (self._gaps.maxlen or 1):
            sentence = f"{len(self._gaps)} of {self._gaps.maxlen} finger readings so far"
            return SlipEvidence(False, "gap", float("nan"), self._limit, sentence)
        value = float(np.median([reading.gap for reading in self._gaps]))
        limit = self._open if value > self._open else self._limit
        sentence = f"pads {1e3 * value:.1f} mm apart, limit {1e3 * limit:.1f} mm"
        return SlipEvidence(not self._limit <= value <= self._open, "gap", value, limit, sentence)
