"""Does a jaw hold what it closed on? The fingers' own test, by the gap between their pads."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from regrasp.interfaces.devices import Gripper
from regrasp.interfaces.evidence import Evidence
from regrasp.interfaces.reading import GripperReading


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

    def evidence(self) -> Evidence:
        """The result so far; nothing is detected until there are enough readings."""
        if len(self._gaps) < (self._gaps.maxlen or 1):
            sentence = f"{len(self._gaps)} of {self._gaps.maxlen} finger readings so far"
            return Evidence(False, "gap", float("nan"), self._closed, sentence)
        value = float(np.median([reading.gap for reading in self._gaps]))
        too_far = value > self._open
        limit = self._open if too_far else self._closed
        allowed = f"{'at most' if too_far else 'at least'} {1e3 * limit:.1f} mm"
        sentence = f"pads {1e3 * value:.1f} mm apart; {allowed} while they hold it"
        return Evidence(not self._closed <= value <= self._open, "gap", value, limit, sentence)


class GripWatch:
    """Watches the pads of a jaw that holds a thing of `thickness` m."""

    def __init__(self, gripper: Gripper, thickness: float, parameters: GapParameters = GapParameters()) -> None:
        self._gripper, self._test = gripper, GapTest(thickness, parameters)

    def evidence(self) -> Evidence:
        """The test's result, the newest reading included; ask every tick."""
        self._test.feed(self._gripper.reading())
        return self._test.evidence()
