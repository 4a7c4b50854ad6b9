"""What is known of the connector over time: three checks (Hwang 2024, section 3.4.2), and what a hand hides."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.sight import Estimate, NoEstimate, TrackHealth, TrackState


@dataclass(frozen=True)
class TrackParameters:
    """Limits of the checks, and how far a hand hides things."""

    max_age: float = 0.5  # s; choice: seven frames at 15 Hz, so that a few lost ones do not start a search
    live_interval: float = 1.0  # s; choice: the thesis shows two poses one second apart
    min_change: float = 1e-6  # m; choice: a mean of noisy depth never repeats to the micrometre, a frozen image does
    hiding_radius: float = 0.10  # m; choice: a hand hides what was last seen within a connector's length of its centre


class ConnectorTrack:
    """The connector's estimates by all cameras, newest last, and whether a hand holds it."""

    def __init__(self, parameters: TrackParameters = TrackParameters()) -> None:
        self._parameters = parameters
        self._estimates: deque[Estimate] = deque()
        self._last_failure: NoEstimate | None = None
        self._tool: FloatArray | None = None
        self._hand_near = False

    @property
    def last(self) -> Estimate | None:
        """The newest estimate, however old."""
        return self._estimates[-1] if self._estimates else None

    def feed(self, result: Estimate | NoEstimate) -> None:
        """Take in what a frame gave.

        An estimate that is not newer than the same camera's last is ignored, since its image is frozen.
        """
        if isinstance(result, NoEstimate):
            self._last_failure = result
            return
        if any(e.camera == result.camera and e.stamp >= result.stamp for e in self._estimates):
            return
        self._estimates.append(result)
        while self._estimates[0].stamp < result.stamp - 2 * self._parameters.live_interval:
            self._estimates.popleft()
        if self._tool is not None:
            self._hand_near = self._is_near(result, self._tool)

    def set_holding_tool(self, tool: FloatArray | None) -> None:
        """Say where the holding gripper's centre (3,) m is, or None when the finger gap says that nothing is held."""
        if tool is not None and self._tool is None:  # a new grasp: it took what was last seen there
            last = self.last
            self._hand_near = last is not None and self._is_near(last, tool)
        self._tool = tool

    def check(self, now: float) -> TrackHealth:
        """The three checks at time `now` (s)."""
        if self.last is None:
            why = f": {self._last_failure.message}" if self._last_failure else ""
            return TrackHealth(False, False, False, f"the connector was never seen{why}")
        limits = self._parameters
        age = now - self.last.stamp
        change = self._change(now)
        fresh, live = age <= limits.max_age, change >= limits.min_change
        seen = f"seen {age:.2f} s ago by the {self.last.camera} camera (at most {limits.max_age:.2f} s)"
        moved = f"changed {1e3 * change:.3f} mm within {limits.live_interval:.1f} s"
        return TrackHealth(True, fresh, live, f"connector {seen}; {moved}")

    def state(self, now: float) -> tuple[TrackState, str]:
        """What is known at time `now` (s), and a sentence. What the hand hides is not lost."""
        health = self.check(now)
        if health.ok:
            return TrackState.VISIBLE, health.reason
        if not health.exists:
            return TrackState.UNKNOWN, health.reason
        if self._tool is not None and self._hand_near:
            return TrackState.HIDDEN_BY_HAND, f"held by the gripper that hides it; {health.reason}"
        return TrackState.LOST, health.reason

    def position(self, now: float) -> FloatArray | None:
        """Best guess (3,) m of where the connector is: as last seen, or in the hand that hides it; None if never seen.

        World frame, like the estimates.
        """
        if self.state(now)[0] is TrackState.HIDDEN_BY_HAND:
            return self._tool
        return None if self.last is None else self.last.position

    def _is_near(self, estimate: Estimate, tool: FloatArray) -> bool:
        return bool(np.linalg.norm(estimate.position - tool) <= self._parameters.hiding_radius)

    def _change(self, now: float) -> float:
        """Diagonal (m) of the box that holds the recent positions; 0 from fewer than two.

        Only those of the newest estimate's camera count: another camera's bias would look like motion.
        """
        camera, begin = self.last.camera if self.last else "", now - self._parameters.live_interval
        recent = [e.position for e in self._estimates if e.camera == camera and e.stamp >= begin]
        return float(np.linalg.norm(np.ptp(recent, axis=0))) if len(recent) > 1 else 0.0
