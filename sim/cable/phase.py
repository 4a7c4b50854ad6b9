"""Phases of the cable task, by ground truth. Faults and the judge depend on them."""

from dataclasses import dataclass

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.fault import Phase


@dataclass(frozen=True)
class PhaseParameters:
    """When a phase has begun."""

    carried_distance: float = 0.10  # m from the socket: the held connector counts as carried; about its own length
    lost_seconds: float = 0.2  # without contact with a pad, clip or socket; a shorter gap is a regrip
    still_speed: float = 0.01  # m/s; a connector no faster than this ...
    still_seconds: float = 1.0  # ... for so long has settled


class PhaseWatch:
    """Notes in `began` at which simulated second each phase first began. `start` (3,) m is where the plug sits."""

    def __init__(self, start: FloatArray, parameters: PhaseParameters = PhaseParameters()) -> None:
        self._start, self._parameters = start, parameters
        self.began: dict[Phase, float] = {}
        self._held = False
        self._untouched_since: float | None = None
        self._still_since: float | None = None

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
            self._watch_loss(now, any(pads) or stowed or not self._held)
        elif all(pads):
            self._begin("regrasped", now)
        elif "settled" not in self.began:
            self._watch_settling(now, speed)

    def _watch_loss(self, now: float, kept: bool) -> None:
        if kept:
            self._untouched_since = None
        elif self._untouched_since is None:
            self._untouched_since = now
        elif now - self._untouched_since >= self._parameters.lost_seconds:
            self._begin("lost", now)

    def _watch_settling(self, now: float, speed: float) -> None:
        if speed > self._parameters.still_speed:
            self._still_since = None
        elif self._still_since is None:
            self._still_since = now
        elif now - self._still_since >= self._parameters.still_seconds:
            self._begin("settled", now)

    def _begin(self, phase: Phase, now: float) -> None:
        self.began.setdefault(phase, now)
