"""The judge of the cable task: whether a run came out as its scenario expects, by ground truth."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from regrasp.app.records.result import Expectation, Slip
from regrasp.app.tasks.cable.expectations import EndState, Expect
from regrasp.behaviors.services import Belief
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.wall_time import counts_as
from regrasp.sim.cable.phase import ConditionTimer, PhaseParameters
from regrasp.sim.ground_truth import GroundTruth


@dataclass(frozen=True)
class JudgeParameters:
    """When the judge says that the connector is held, and that it slides in the jaw."""

    hold_seconds: float = 0.5  # with both pads in touch: a hand that closes beside its middle may push it away again
    slide_distance: float = 0.003  # m in the jaw ...
    slide_seconds: float = 0.5  # ... within this time: a squeezed connector slid so slowly for 1 s, then slipped out


class GripWatch:
    """Watches whether the connector slides in the jaw that holds it."""

    def __init__(self, parameters: JudgeParameters = JudgeParameters()) -> None:
        self._parameters = parameters
        self._offsets: deque[tuple[float, FloatArray]] = deque()
        self.sliding = ConditionTimer()

    def update(self, now: float, offset: FloatArray) -> None:
        """Take the connector's position (3,) m in the hand's frame at second `now`."""
        self._offsets.append((now, offset))
        while self._offsets[0][0] < now - self._parameters.slide_seconds:
            self._offsets.popleft()
        moved = float(np.linalg.norm(offset - self._offsets[0][1]))
        self.sliding.update(now, moved >= self._parameters.slide_distance)


class Judge:
    """Watches the ground truth at every tick; at the end it compares with the scenario's expectations."""

    def __init__(self, truth: GroundTruth, expect: Expect, parameters: JudgeParameters = JudgeParameters()) -> None:
        self._truth, self._expect, self._parameters = truth, expect, parameters
        self._now = 0.0
        self._was_held = False
        self._held = ConditionTimer()  # both pads touch it
        self._grip = GripWatch(parameters)
        self._unheld_at: float | None = None  # when it lost a pad's contact or, if that was earlier, began to slide
        self._untouched, self._still = ConditionTimer(), ConditionTimer()  # after a hold
        self.grasps = 0  # how often the hand has grasped it
        self.losses: list[float] = []  # seconds
        self.settled_pixels: int | None = None  # of the connector in the rear image when it had settled after a loss
        self.found_by: str | None = None  # the camera that found the connector first after its loss

    @counts_as("record")
    def observe(self, now: float, belief: Belief) -> None:
        """Update with the ground truth after a tick at second `now`."""
        self._now = now
        self.found_by = self.found_by or belief.found_by
        if self._truth.held():
            self._watch_hold(now)
            return
        self._held.update(now, False)
        if self._was_held and not self._truth.stowed():
            if self._unheld_at is None:
                self._unheld_at = now if self._grip.sliding.since is None else self._grip.sliding.since
            if self._untouched.update(now, not self._truth.touched()) >= PhaseParameters.lost_seconds:
                self.losses.append(self._unheld_at)
                self._was_held, self._grip = False, GripWatch(self._parameters)
        if self.losses and not self._was_held and self.settled_pixels is None:
            slow = self._truth.connector_speed() <= PhaseParameters.still_speed
            if self._still.update(now, slow) >= PhaseParameters.still_seconds:
                self.settled_pixels = self._truth.connector_pixels("rear")

    def _watch_hold(self, now: float) -> None:
        held_seconds = self._held.update(now, True)
        self._grip.update(now, self._truth.connector_in_hand())
        self._unheld_at = None
        self._untouched.update(now, False)
        self._still.update(now, False)
        if not self._was_held and held_seconds >= self._parameters.hold_seconds:
            self.grasps += 1
            self._was_held = True

    def slips(self, belief: Belief) -> tuple[Slip, ...]:
        """Each real loss, with the first notice after it and before the next one.

        A loss begins when the connector slides in the jaw: the robot may notice this before the last pad lets go.
        """
        slips = []
        for released, end in pairwise([*self.losses, float("inf")]):
            notice = next((n for n in belief.notices if released <= n.at < end), None)
            slips.append(Slip(released, notice.at if notice else None, notice.by if notice else None))
        return tuple(slips)

    def expectations(self, outcome: str, cause: str | None, belief: Belief) -> tuple[Expectation, ...]:
        """Every expectation of the scenario, met or not, given how the run ended and what the robot believes."""
        wanted = self._expect
        found = [Expectation("outcome", outcome == wanted.outcome, outcome, wanted.outcome)]
        if wanted.end_state is not None:
            end = self._end_state()
            found.append(Expectation("end", end == wanted.end_state, end, wanted.end_state))
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

    def _end_state(self) -> EndState:
        if self._truth.stowed():
            return "stowed"
        if self._truth.plugged():
            return "plugged"
        return "held" if self._truth.held() else "lost"

    def _limits(self, belief: Belief) -> Iterator[Expectation]:
        """The expectations that are upper limits."""
        wanted = self._expect
        yield from _at_most("sim_seconds", self._now, wanted.sim_seconds)
        yield from _at_most("tries", self.grasps, wanted.tries)
        yield from _at_most("detection_delay", self._longest_delay(belief), wanted.detection_delay)
        peak = max(self._truth.contact_peaks().values(), default=0.0)
        yield from _at_most("unintended_force", peak, wanted.unintended_force)
        if wanted.pose_error is not None:
            position, angle_deg = self._truth.seat_error()
            yield from _at_most("pose_error.position", position, wanted.pose_error.position)
            yield from _at_most("pose_error.angle_deg", angle_deg, wanted.pose_error.angle_deg)

    def _longest_delay(self, belief: Belief) -> float | None:
        """The longest time (s) from a loss to its notice; 0 without a loss, None if one was not noticed."""
        delays = [None if s.detected_at is None else s.detected_at - s.released_at for s in self.slips(belief)]
        known = [delay for delay in delays if delay is not None]
        return max(known, default=0.0) if len(known) == len(delays) else None


def _at_most(name: str, value: float | None, limit: float | None) -> Iterator[Expectation]:
    if limit is not None:
        yield Expectation(name, value is not None and value <= limit, value and round(value, 4), limit)
