"""Which part of the job has begun, judged by the truth: what faults and the judge go by."""

import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.fault import Phase

AWAY = 0.10  # m from its socket: the held end is carried
LOST_SECONDS = 0.2  # without any pad's touch, out of clip and socket: the hold is really lost, not regripped
STILL_SPEED = 0.01  # m/s ...
STILL_SECONDS = 1.0  # ... for so long: settled


class PhaseWatch:
    """Notes in `began` at which simulated second each phase first began. `start` (3,) m is where the plug sits."""

    def __init__(self, start: NDArray[np.float64]) -> None:
        self._start = start
        self.began: dict[Phase, float] = {}
        self._held = False
        self._untouched_since: float | None = None
        self._still_since: float | None = None

    def step(
        self,
        now: float,
        position: NDArray[np.float64],
        speed: float,
        pads: tuple[bool, bool],
        plugged: bool,
        stowed: bool,
    ) -> None:
        """Look at the connector: its centre (3,) m, speed m/s, which pads touch it, whether socket or clip hold it."""
        if plugged:
            return
        self._begin("unplugged", now)
        if all(pads) and float(np.linalg.norm(position - self._start)) > AWAY:
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
        elif now - self._untouched_since >= LOST_SECONDS:
            self._begin("lost", now)

    def _watch_settling(self, now: float, speed: float) -> None:
        if speed > STILL_SPEED:
            self._still_since = None
        elif self._still_since is None:
            self._still_since = now
        elif now - self._still_since >= STILL_SECONDS:
            self._begin("settled", now)

    def _begin(self, phase: Phase, now: float) -> None:
        self.began.setdefault(phase, now)
