"""Whether a run came out as its scenario expects, by ground truth."""

from collections import deque
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from regrasp.app.records.result import Expectation, Slip
from regrasp.app.tasks.cable.expectations import Expect
from regrasp.behaviors.services import Belief
from regrasp.sim.cable.phase import PhaseParameters
from regrasp.sim.ground_truth import GroundTruth

HOLD_SECONDS = 0.5  # of both pads' touch: a hand that closes beside its middle may touch it and push it away
SLIDE = 0.003  # m in the jaw ...
SLIDE_SECONDS = 0.5  # ... within so long: a squeezed end crept so for a second before it sprang out


class GripWatch:
    """Whether the end slides in the jaw that holds it."""

    def __init__(self) -> None:
        self._offsets: deque[tuple[float, NDArray[np.float64]]] = deque()
        self.slid_at: float | None = None  # since when it slides; None while it sits fast

    def feed(self, now: float, offset: NDArray[np.float64]) -> None:
        """Take the end's place (3,) m in the hand at second `now`."""
        self._offsets.append((now, offset))
        while self._offsets[0][0] < now - SLIDE_SECONDS:
            self._offsets.popleft()
        if float(np.linalg.norm(offset - self._offsets[0][1])) < SLIDE:
            self.slid_at = None
        elif self.slid_at is None:
            self.slid_at = now


class Judge:
    """Watches the truth at every tick and holds it against a scenario's expectations at the end."""

    def __init__(self, truth: GroundTruth, expect: Expect) -> None:
        self._truth, self._expect = truth, expect
        self._now = 0.0
        self._was_held = False
        self._held_since: float | None = None  # since when both pads touch it
        self._grip = GripWatch()
        self._unheld_at: float | None = None  # since when not both pads touch it, or it slid before that
        self._untouched_at: float | None = None  # since when none does
        self._still_since: float | None = None
        self.takes = 0  # times that the hand took hold of it
        self.losses: list[float] = []
        self.settled_pixels: int | None = None  # of the connector in the rear image once it had settled after a loss
        self.found_by: str | None = None  # the camera that found the connector first after its loss

    def observe(self, now: float, belief: Belief) -> None:
        """Look at the truth after a tick at second `now`."""
        self._now = now
        self.found_by = self.found_by or belief.found_by
        if self._truth.held():
            self._watch_hold(now)
            return
        self._held_since = None
        if self._was_held and not self._truth.stowed():
            if self._unheld_at is None:
                self._unheld_at = now if self._grip.slid_at is None else self._grip.slid_at
            if self._truth.touched():
                self._untouched_at = None
            else:
                self._untouched_at = now if self._untouched_at is None else self._untouched_at
                if now - self._untouched_at >= PhaseParameters.lost_seconds:
                    self.losses.append(self._unheld_at)
                    self._was_held, self._grip = False, GripWatch()
        if self.losses and not self._was_held and self.settled_pixels is None:
            self._watch_settling(now)

    def _watch_hold(self, now: float) -> None:
        self._held_since = now if self._held_since is None else self._held_since
        self._grip.feed(now, self._truth.connector_in_hand())
        self._unheld_at = self._untouched_at = self._still_since = None
        if not self._was_held and now - self._held_since >= HOLD_SECONDS:
            self.takes += 1
            self._was_held = True

    def slips(self, belief: Belief) -> tuple[Slip, ...]:
        """Each real loss with the first notice that came after it and before the next.

        A loss begins when the end slides in the jaw: a robot that sees this may notice it before the last pad lets go.
        """
        slips = []
        for released, end in pairwise([*self.losses, float("inf")]):
            notice = next((n for n in belief.notices if released <= n.at < end), None)
            slips.append(Slip(released, notice.at if notice else None, notice.by if notice else None))
        return tuple(slips)

    def expectations(self, outcome: str, cause: str | None, belief: Belief) -> tuple[Expectation, ...]:
        """Every expectation of the scenario, met or not."""
        wanted = self._expect
        ended = "lost" if outcome == "stowed" and not self._truth.stowed() else outcome
        found = [Expectation("outcome", ended == wanted.outcome, ended, wanted.outcome)]
        if wanted.cause is not None:
            found.append(Expectation("cause", cause == wanted.cause, cause, wanted.cause.value))
        if wanted.slips is not None:
            noticed = sum(slip.detected_at is not None for slip in self.slips(belief))
            met = noticed >= wanted.slips and noticed == len(self.losses)
            found.append(Expectation("slips", met, noticed, wanted.slips))
        if wanted.hidden is not None:
            hidden = self.settled_pixels == 0 and self.found_by == "wrist"
            found.append(Expectation("hidden", hidden == wanted.hidden, hidden, wanted.hidden))
        return (*found, *self._limits(belief))

    def _limits(self, belief: Belief) -> Iterator[Expectation]:
        """What must not be more than the scenario says."""
        wanted = self._expect
        yield from _at_most("sim_seconds", self._now, wanted.sim_seconds)
        yield from _at_most("tries", self.takes, wanted.tries)
        yield from _at_most("detection_delay", self._longest_delay(belief), wanted.detection_delay)
        peak = max(self._truth.contact_peaks().values(), default=0.0)
        yield from _at_most("unintended_force", peak, wanted.unintended_force)
        if wanted.pose_error is not None:
            position, angle_deg = self._truth.seat_error()
            yield from _at_most("pose_error.position", position, wanted.pose_error.position)
            yield from _at_most("pose_error.angle_deg", angle_deg, wanted.pose_error.angle_deg)

    def _longest_delay(self, belief: Belief) -> float | None:
        """Seconds from a loss to its notice, the longest; 0 without a loss, None when one went unseen."""
        delays = [None if s.detected_at is None else s.detected_at - s.released_at for s in self.slips(belief)]
        known = [delay for delay in delays if delay is not None]
        return max(known, default=0.0) if len(known) == len(delays) else None

    def _watch_settling(self, now: float) -> None:
        if self._truth.connector_speed() > PhaseParameters.still_speed:
            self._still_since = None
        elif self._still_since is None:
            self._still_since = now
        elif now - self._still_since >= PhaseParameters.still_seconds:
            self.settled_pixels = self._truth.connector_pixels("rear")


def _at_most(name: str, value: float | None, limit: float | None) -> Iterator[Expectation]:
    if limit is not None:
        yield Expectation(name, value is not None and value <= limit, value and round(value, 4), limit)
