"""The judge of the cable task: whether a run came out as its scenario expects, by ground truth."""

from collections import deque
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from regrasp.app.task.expectation import Expectation
from regrasp.app.task.judge import Judge, at_most
from regrasp.app.tasks.cable.expectations import EndState, Expect
from regrasp.behaviors.cable.keys import FOUND, NOTICES
from regrasp.behaviors.cable.services import CableServices
from regrasp.behaviors.keys import value_of
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import PLUGGED_INTO
from regrasp.interfaces.wall_time import counts_as
from regrasp.sim.cable.ground_truth import CableTruth
from regrasp.sim.cable.objects import CableObjects
from regrasp.sim.cable.phase import ConditionTimer, PhaseParameters
from regrasp.sim.world import World


@dataclass(frozen=True)
class JudgeParameters:
    """When the judge says that the connector is held, and that it slides in the jaw."""

    hold_seconds: float = 0.5  # with both pads in touch: a hand that closes beside its middle may push it away again
    slide_distance: float = 0.003  # m in the jaw ...
    slide_seconds: float = 0.5  # ... within this time: a squeezed connector slid so slowly for 1 s, then slipped out
    let_go_seconds: float = 0.5  # from a hand's word that it lets go until the connector has left the open jaw; choice


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


@dataclass(frozen=True)
class Slip:
    """One loss of the connector, in simulated seconds; None: it was not noticed."""

    released_at: float
    detected_at: float | None
    detected_by: str | None


class CableJudge(Judge[Expect]):
    """Watches the connector at every tick; at the end it compares with the scenario's expectations."""

    def __init__(
        self,
        world: World[CableObjects],
        services: CableServices,
        expect: Expect,
        parameters: JudgeParameters = JudgeParameters(),
        truth: CableTruth | None = None,
    ) -> None:
        super().__init__(world, services, expect)
        self._truth, self._parameters = truth or CableTruth(world), parameters
        self._cable = world.objects.cell.known.cable
        self._was_held = False
        self._held = ConditionTimer()  # both pads touch it
        self._grip = GripWatch(parameters)
        self._unheld_at: float | None = None  # when it lost a pad's contact or, if that was earlier, began to slide
        self._untouched, self._still = ConditionTimer(), ConditionTimer()  # after a hold
        self.grasps = 0  # how often the hand has grasped it
        self.losses: list[float] = []  # seconds
        self.settled_pixels: int | None = None  # of the connector in the rear image, where it lay before it was found
        self.found_by: str | None = None  # the camera that found the connector first after its loss

    @counts_as("record")
    def observe(self, now: float) -> None:
        """Update with the ground truth after a tick at second `now`."""
        self.found_by = self.found_by or _found_by()
        if self._truth.held():
            self._watch_hold(now)
            return
        self._held.update(now, False)
        if self._was_held and not (self._truth.stowed() or self._truth.plugged()):
            if self._unheld_at is None:
                self._unheld_at = now if self._grip.sliding.since is None else self._grip.sliding.since
            if self._untouched.update(now, not self._truth.touched()) >= PhaseParameters.lost_seconds:
                self.losses.append(self._unheld_at)
                self._was_held, self._grip = False, GripWatch(self._parameters)
        if self.losses and not self._was_held:
            slow = self._truth.connector_speed() <= PhaseParameters.still_speed
            still_seconds = self._still.update(now, slow)
            if not slow and self.found_by is None:  # it fell on from where it lay first
                self.settled_pixels = None
            elif self.settled_pixels is None and still_seconds >= PhaseParameters.still_seconds:
                self.settled_pixels = self._truth.connector_pixels(self._cable.overview)

    def _watch_hold(self, now: float) -> None:
        held_seconds = self._held.update(now, True)
        self._grip.update(now, self._truth.connector_in_hand())
        self._unheld_at = None
        self._untouched.update(now, False)
        self._still.update(now, False)
        if not self._was_held and held_seconds >= self._parameters.hold_seconds:
            self.grasps += 1
            self._was_held = True

    def slips(self) -> tuple[Slip, ...]:
        """Each real loss, with the first notice after it and before the next one.

        A loss begins when the connector slides in the jaw: the robot may notice this before the last pad lets go. One
        that is let fall on purpose begins with the hand's word.
        """
        said, late = [n.at for n in value_of(NOTICES) if n.by == "hand"], self._parameters.let_go_seconds
        begins = [max((at for at in said if lost - late <= at <= lost), default=lost) for lost in self.losses]
        slips = []
        for begin, end in pairwise([*begins, float("inf")]):
            notice = next((n for n in value_of(NOTICES) if begin <= n.at < end), None)
            slips.append(Slip(begin, notice.at if notice else None, notice.by if notice else None))
        return tuple(slips)

    def measured(self) -> dict[str, Any]:
        """The slips."""
        return {"slips": [asdict(slip) for slip in self.slips()]}

    def states(self) -> Iterator[Expectation]:
        """Where the connector is at the end."""
        if (wanted := self.expect.end_state) is not None:
            end = self._end_state()
            yield Expectation("end", end == wanted, end, wanted)
        if (name := self.expect.socket) is not None:
            name = self._cable.plugged_into if name == PLUGGED_INTO else name
            socket = self._truth.plugged_into()
            yield Expectation("socket", socket == name, socket, name)

    def _end_state(self) -> EndState:
        if self._truth.stowed():
            return "stowed"
        if self._truth.plugged():
            return "plugged"
        return "held" if self._truth.held() else "lost"

    def limits(self) -> Iterator[Expectation]:
        """Losses and how soon they were noticed, then the limits of every task, then the seat's error."""
        wanted = self.expect
        if wanted.slips is not None:
            noticed = sum(slip.detected_at is not None for slip in self.slips())
            met = noticed >= wanted.slips and noticed == len(self.losses)
            yield Expectation("slips", met, noticed, wanted.slips)
        if wanted.hidden is not None:
            hidden = self.settled_pixels == 0 and self.found_by == self._cable.search
            yield Expectation("hidden", hidden == wanted.hidden, hidden, wanted.hidden)
        yield from at_most("tries", self.grasps, wanted.tries)
        yield from at_most("detection_delay", self._longest_delay(), wanted.detection_delay)
        yield from super().limits()
        if wanted.pose_error is not None:
            position, angle_deg = self._truth.seat_error()
            yield from at_most("pose_error.position", position, wanted.pose_error.position)
            yield from at_most("pose_error.angle_deg", angle_deg, wanted.pose_error.angle_deg)

    def _longest_delay(self) -> float | None:
        """The longest time (s) from a loss to its notice; 0 without a loss, None if one was not noticed."""
        delays = [None if s.detected_at is None else s.detected_at - s.released_at for s in self.slips()]
        known = [delay for delay in delays if delay is not None]
        return max(known, default=0.0) if len(known) == len(delays) else None


def _found_by() -> str | None:
    """The camera that found the connector last, None while it is not found."""
    found = value_of(FOUND, None)
    return None if found is None else found.camera
