"""Phases of the cable task, by ground truth. Faults and the judge depend on them."""

from dataclasses import dataclass

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.fault import Phase


@dataclass(frozen=True)
class PhaseParameters:
    """When a phase has begun."""

    carried_distance: float = 0.10  # m from the socket: the held connector counts as carried; about its own length
    lost_seconds: float = 0.2  # without contact with a pad, clip or socket; a shorter gap is a regrip
    still_speed: float = 0.01  # m/s; a connector no faster than this ...
    still_seconds: float = 1.0  # ... for so long has settled


class ConditionTimer:
    """For how long a condition has held without a break; `since` is the second it began at, None while it fails."""

    def __init__(self) -> None:
        self.since: float | None = None

    def update(self, now: float, holds: bool) -> float:
        """Seconds that the condition has held, given whether it does at second `now`; 0 while it fails."""
        if not holds:
            self.since = None
            return 0.0
        if self.since is None:
            self.since = now
        return now - self.since


class PhaseWatch:
    """Notes in `began` at which simulated second each phase first began. `start` (3,) m is where the plug sits."""

    def __init__(self, start: FloatArray, parameters: PhaseParameters = PhaseParameters()) -> None:
        self._start, self._parameters = start, parameters
        self.began: dict[str, float] = {}
        self._held = False
        self._untouched, self._still = ConditionTimer(), ConditionTimer()

    def step(
        self, now: float, position: FloatArray, speed: float, pads: tuple[bool, bool], plugged: bool, stowed: bool
    ) -> None:
        """Update with the connector's state at second `now`.

        `position` (3,) m is that of its centre, `speed` is in m/s. `pads` says which pads touch it, `plugged` and
        `stowed` whether the socket or the clip holds it.
        """
        if plugged:
            return
        self._begin("unplugged", now)
        if all(pads) and float(np.linalg.norm(position - self._start)) > self._parameters.carried_distance:
            self._begin("carried", now)
        if "lost" not in self.began:
            self._held = self._held or all(pads)
            untouched = self._held and not any(pads) and not stowed
            if self._untouched.update(now, untouched) >= self._parameters.lost_seconds:
                self._begin("lost", now)
        elif all(pads):
            self._begin("regrasped", now)
        elif self._still.update(now, speed <= self._parameters.still_speed) >= self._parameters.still_seconds:
            self._begin("settled", now)

    def _begin(self, phase: Phase, now: float) -> None:
        self.began.setdefault(phase, now)
