"""What is known of the connector over time: three checks (Hwang 2024, section 3.4.2), and what a hand hides."""

from collections import deque
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from regrasp.perception.pose.estimate import Estimate, NoEstimate

FloatArray = NDArray[np.float64]

FRESH_LIMIT = 0.5  # s; choice: seven frames at 15 Hz, so that a few lost ones do not start a search
LIVE_INTERVAL = 1.0  # s; choice: the thesis shows two poses one second apart
LIVE_CHANGE = 1e-6  # m; choice: a mean of quantised noisy depth never repeats to the micrometre, a frozen image does
HIDING_RADIUS = 0.10  # m; choice: a hand can hide what was last seen within a connector's length of its centre


class TrackState(StrEnum):
    """What the track says of the connector."""

    VISIBLE = "visible"
    HIDDEN_BY_HAND = "hidden_by_hand"
    LOST = "lost"
    UNKNOWN = "unknown"  # never seen


@dataclass(frozen=True)
class TrackHealth:
    """The thesis's three checks: the connector's frame exists, is fresh, is live. `reason` is a sentence."""

    exists: bool
    fresh: bool
    live: bool
    reason: str

    @property
    def ok(self) -> bool:
        """Whether all three hold, so that no search is needed."""
        return self.exists and self.fresh and self.live


class ConnectorTrack:
    """The connector's estimates of all cameras, newest last, and whether a hand holds it."""

    def __init__(
        self, fresh_limit: float = FRESH_LIMIT, live_interval: float = LIVE_INTERVAL, live_change: float = LIVE_CHANGE
    ) -> None:
        """Limits in seconds, seconds and metres."""
        self._fresh_limit, self._live_interval, self._live_change = fresh_limit, live_interval, live_change
        self._estimates: deque[Estimate] = deque()
        self._last_miss: NoEstimate | None = None
        self._tool: FloatArray | None = None
        self._hand_near = False

    @property
    def last(self) -> Estimate | None:
        """The newest estimate, however old."""
        return self._estimates[-1] if self._estimates else None

    def feed(self, result: Estimate | NoEstimate) -> None:
        """Take in what a frame gave. One that is not newer than the same camera's last is ignored: a frozen image."""
        if isinstance(result, NoEstimate):
            self._last_miss = result
            return
        if any(e.camera == result.camera and e.stamp >= result.stamp for e in self._estimates):
            return
        self._estimates.append(result)
        while self._estimates[0].stamp < result.stamp - 2 * self._live_interval:
            self._estimates.popleft()
        if self._tool is not None:
            self._hand_near = bool(np.linalg.norm(result.position - self._tool) <= HIDING_RADIUS)

    def held(self, tool: FloatArray | None) -> None:
        """Say where the holding gripper's centre (3,) m is, or None when the finger gap says that nothing is held."""
        if tool is not None and self._tool is None:  # a new grasp: it took what was last seen there
            last = self.last
            self._hand_near = last is not None and bool(np.linalg.norm(last.position - tool) <= HIDING_RADIUS)
        self._tool = tool

    def check(self, now: float) -> TrackHealth:
        """The three checks at second `now`."""
        if self.last is None:
            why = f": {self._last_miss.message}" if self._last_miss else ""
            return TrackHealth(False, False, False, f"the connector was never seen{why}")
        age = now - self.last.stamp
        change = self._change(now)
        fresh, live = age <= self._fresh_limit, change >= self._live_change
        seen = f"seen {age:.2f} s ago by the {self.last.camera} camera, limit {self._fresh_limit:.2f} s"
        moved = f"changed {1e3 * change:.3f} mm within {self._live_interval:.1f} s"
        return TrackHealth(True, fresh, live, f"connector {seen}; {moved}")

    def state(self, now: float) -> tuple[TrackState, str]:
        """What is known at second `now`, and a sentence. What the hand hides is not lost."""
        health = self.check(now)
        if health.ok:
            return TrackState.VISIBLE, health.reason
        if not health.exists:
            return TrackState.UNKNOWN, health.reason
        if self._tool is not None and self._hand_near:
            return TrackState.HIDDEN_BY_HAND, f"held by the gripper that hides it; {health.reason}"
        return TrackState.LOST, health.reason

    def position(self, now: float) -> FloatArray | None:
        """Best guess (3,) m of where the connector is: as last seen, or in the hand that hides it."""
        if self.state(now)[0] is TrackState.HIDDEN_BY_HAND:
            return self._tool
        return None if self.last is None else self.last.position

    def drift(self, now: float) -> FloatArray:
        """Velocity (3,) m/s over the live interval before `now`, by least squares; 0 from fewer than three."""
        recent = self._recent(now)
        if len(recent) < 3:
            return np.zeros(3)
        t = np.array([e.stamp for e in recent])
        t -= t.mean()
        return np.asarray(t @ np.array([e.position for e in recent]) / (t @ t))

    def _recent(self, now: float) -> list[Estimate]:
        """The newest estimate's camera's within the interval; another camera's bias would look like motion."""
        camera = self.last.camera if self.last else ""
        return [e for e in self._estimates if e.camera == camera and e.stamp >= now - self._live_interval]

    def _change(self, now: float) -> float:
        """Metres between the corners of the box that holds the recent positions; 0 from fewer than two."""
        recent = self._recent(now)
        return float(np.linalg.norm(np.ptp([e.position for e in recent], axis=0))) if len(recent) > 1 else 0.0
