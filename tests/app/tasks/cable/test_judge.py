from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray
from py_trees.blackboard import Blackboard
from scipy.spatial.transform import RigidTransform

from regrasp.app.tasks.cable.expectations import Expect, PoseError
from regrasp.app.tasks.cable.judge import CableJudge
from regrasp.behaviors.cable.keys import FOUND, NOTICES, Found, LossNotice
from regrasp.behaviors.keys import put, value_of
from regrasp.interfaces.cause import CauseCode
from regrasp.sim.cable.ground_truth import CableTruth
from regrasp.sim.cable.phase import PhaseParameters

TICK = 0.05


@dataclass
class Truth:
    """A ground truth that a test writes."""

    fingers: int = 0  # that touch the connector
    in_clip: bool = False
    in_socket: bool = False
    socket: str = "back_4"
    speed: float = 0.0
    pixels: int = 0
    peaks: dict[str, float] = field(default_factory=dict)
    seat: tuple[float, float] = (0.002, 1.5)  # m and degrees from the clip's
    in_hand: float = 0.0  # m along the jaw

    def held(self) -> bool:
        return self.fingers == 2

    def touched(self) -> bool:
        return self.fingers > 0

    def stowed(self) -> bool:
        return self.in_clip

    def plugged(self) -> bool:
        return self.in_socket

    def plugged_into(self) -> str | None:
        return self.socket if self.in_socket else None

    def connector_in_hand(self) -> NDArray[np.float64]:
        return np.array([0.0, 0.0, self.in_hand])

    def connector_speed(self) -> float:
        return self.speed

    def connector_pixels(self, camera: str) -> int:
        return self.pixels if camera == "rear" else 10_000

    def seat_error(self) -> tuple[float, float]:
        return self.seat

    def contact_peaks(self) -> dict[str, float]:
        return self.peaks


@dataclass
class Run:
    """A judge, what it sees, and what the robot believes."""

    expect: Expect = field(default_factory=Expect)
    truth: Truth = field(default_factory=Truth)
    tick: int = 0

    def __post_init__(self) -> None:
        Blackboard.clear()
        cable = SimpleNamespace(overview="rear", search="wrist", plugged_into="back_4")
        cell = SimpleNamespace(known=SimpleNamespace(cable=cable))
        world = SimpleNamespace(
            objects=SimpleNamespace(cell=cell), now=lambda: (self.tick - 1) * TICK, contact_peaks=self.truth.peaks
        )
        self.judge = CableJudge(cast(Any, world), cast(Any, None), self.expect, truth=cast(CableTruth, self.truth))

    def notice(self, *notices: LossNotice) -> None:
        """Let the robot notice these losses."""
        put(NOTICES, (*value_of(NOTICES), *notices))

    def find(self, camera: str) -> None:
        """Let the robot find the connector by that camera."""
        put(FOUND, Found(RigidTransform.identity(), whole=True, camera=camera))

    def go(self, seconds: float, **truth: Any) -> float:
        """Let the truth be so for so long; the second at which that began."""
        for name, value in truth.items():
            setattr(self.truth, name, value)
        begin = self.tick * TICK
        for _ in range(round(seconds / TICK)):
            self.judge.observe(self.tick * TICK)
            self.tick += 1
        return begin

    def verdict(self, name: str, outcome: str = "success", cause: str | None = None) -> tuple[bool, Any]:
        [found] = [e for e in self.judge.expectations(outcome, cause) if e.name == name]
        return found.met, found.value


def test_an_end_never_held_is_not_lost() -> None:
    run = Run()
    run.go(5.0)
    assert run.judge.losses == []


def test_a_loss_is_dated_from_the_moment_of_release() -> None:
    run = Run()
    run.go(1.0, fingers=2)
    released = run.go(3.0, fingers=0)
    assert run.judge.losses == [pytest.approx(released)]


def test_a_loss_is_dated_from_the_first_pad_s_letting_go() -> None:
    run = Run()
    run.go(1.0, fingers=2)
    slides = run.go(0.5, fingers=1)
    run.go(1.0, fingers=0)
    assert run.judge.losses == [pytest.approx(slides)]


def test_an_end_that_slides_out_of_the_jaw_is_being_lost_before_the_pads_let_go() -> None:
    run = Run(Expect(slips=1, detection_delay=0.5))
    run.go(1.0, fingers=2)
    slides = run.go(0.2, in_hand=0.01)
    run.go(1.0, fingers=0)
    assert run.judge.losses == [pytest.approx(slides)]
    run.notice(LossNotice(slides + 0.1, "gap"))
    assert run.verdict("slips") == (True, 1)
    assert run.verdict("detection_delay") == (True, pytest.approx(0.1))


def test_a_touch_while_the_hand_closes_is_neither_hold_nor_loss() -> None:
    run = Run(Expect(tries=1))
    run.go(0.3, fingers=2)
    run.go(1.0, fingers=0)
    assert (run.judge.losses, run.judge.grasps) == ([], 0)


def test_what_slid_and_was_held_fast_again_is_lost_only_later() -> None:
    run = Run()
    run.go(1.0, fingers=2)
    run.go(2.0, in_hand=0.01)
    released = run.go(1.0, fingers=0)
    assert run.judge.losses == [pytest.approx(released)]


def test_a_false_alarm_is_no_notice_of_the_loss_that_it_brings_about() -> None:
    run = Run(Expect(slips=1))
    alarm = run.go(0.2, fingers=2)
    run.notice(LossNotice(alarm + 0.1, "gap"))
    run.go(1.0, fingers=0)  # the robot opens its jaw
    assert run.verdict("slips") == (False, 0)


@pytest.mark.parametrize(("gap", "losses"), [(0.15, 0), (0.30, 1)])
def test_a_hold_regained_within_a_moment_is_no_loss(gap: float, losses: int) -> None:
    run = Run()
    run.go(1.0, fingers=2)
    run.go(gap, fingers=0)
    run.go(1.0, fingers=2)
    assert len(run.judge.losses) == losses


@pytest.mark.parametrize("place", ["in_clip", "in_socket"])
def test_what_one_pad_still_touches_or_clip_or_socket_holds_is_not_lost(place: str) -> None:
    run = Run()
    run.go(1.0, fingers=2)
    run.go(2.0, fingers=1)
    run.go(2.0, fingers=0, **{place: True})
    assert run.judge.losses == []


def test_each_loss_has_the_first_notice_before_the_next() -> None:
    run = Run()
    run.go(1.0, fingers=2)
    first = run.go(1.0, fingers=0)
    run.go(1.0, fingers=2)
    second = run.go(1.0, fingers=0)
    run.notice(
        LossNotice(0.5, "distance"),
        LossNotice(first + 0.2, "gap"),
        LossNotice(first + 0.4, "place"),
    )
    one, two = run.judge.slips()
    assert (one.released_at, one.detected_at) == pytest.approx((first, first + 0.2))
    assert one.detected_by == "gap"
    assert two.released_at == pytest.approx(second)
    assert two.detected_at is None
    assert two.detected_by is None


def test_what_the_hand_lets_fall_on_purpose_is_noticed_as_it_says_so() -> None:
    """The open jaw touches the connector for a tick more."""
    run = Run(Expect(slips=1, detection_delay=0.5))
    run.go(1.0, fingers=2)
    said = run.go(0.1, fingers=2)
    run.notice(LossNotice(said, "hand"))
    run.go(1.0, fingers=0)
    [slip] = run.judge.slips()
    assert (slip.released_at, slip.detected_at, slip.detected_by) == (said, said, "hand")
    assert run.verdict("slips") == (True, 1)
    assert run.verdict("detection_delay") == (True, 0.0)


def test_slips_are_met_when_every_loss_was_noticed_and_there_were_enough() -> None:
    run = Run(Expect(slips=1))
    assert run.verdict("slips") == (False, 0)
    run.go(1.0, fingers=2)
    lost = run.go(1.0, fingers=0)
    assert run.verdict("slips") == (False, 0)
    run.notice(LossNotice(lost + 0.3, "gap"))
    assert run.verdict("slips") == (True, 1)
    run.go(1.0, fingers=2)
    run.go(1.0, fingers=0)  # a second one, unnoticed
    assert run.verdict("slips") == (False, 1)


def lost_and_settled(run: Run, pixels: int) -> None:
    run.go(1.0, fingers=2, pixels=500)
    run.go(2.0, fingers=0, speed=0.3, pixels=0)  # swings past behind the obstacle: that does not count
    run.go(PhaseParameters().still_seconds + 0.2, speed=0.001, pixels=pixels)


def test_hidden_is_an_empty_mask_once_settled_and_a_find_by_the_wrist_camera() -> None:
    run = Run(Expect(hidden=True))
    lost_and_settled(run, pixels=0)
    assert run.verdict("hidden") == (False, False)  # nobody found it yet
    run.find("wrist")
    run.go(1.0, pixels=900)  # what the arm does to it afterwards does not matter
    run.find("rear")
    run.go(1.0)
    assert run.verdict("hidden") == (True, True)


@pytest.mark.parametrize(("pixels", "by"), [(3, "wrist"), (0, "rear")])
def test_an_end_in_sight_or_found_by_the_rear_camera_was_not_hidden(pixels: int, by: str) -> None:
    run = Run(Expect(hidden=True))
    lost_and_settled(run, pixels)
    run.find(by)
    run.go(0.1)
    assert run.verdict("hidden") == (False, False)


def test_the_end_is_by_the_truth_not_by_what_the_robot_says() -> None:
    run = Run()
    run.go(0.1, in_clip=False)
    assert run.verdict("end") == (False, "lost")
    run.go(0.1, fingers=2)
    assert run.verdict("end") == (False, "held")
    run.go(0.1, in_socket=True)
    assert run.verdict("end") == (False, "plugged")
    run.go(0.1, in_socket=False, in_clip=True)
    assert run.verdict("end") == (True, "stowed")
    assert run.verdict("outcome", outcome="time_limit") == (False, "time_limit")


@pytest.mark.parametrize("wanted", ["back_4", "plugged_into"])
def test_the_socket_that_holds_the_end_is_the_expected_one(wanted: str) -> None:
    run = Run(Expect(socket=wanted))
    run.go(0.1)
    assert run.verdict("end") == (False, "lost")
    assert run.verdict("socket") == (False, None)
    run.go(0.1, in_socket=True, socket="back_1")
    assert run.verdict("end") == (True, "plugged")
    assert run.verdict("socket") == (False, "back_1")
    run.go(0.1, socket="back_4")
    assert run.verdict("socket") == (True, "back_4")


def test_a_failure_that_is_expected_is_met_by_its_cause() -> None:
    run = Run(Expect(outcome="failure", cause=CauseCode.OUT_OF_REACH))
    assert run.verdict("outcome", "failure") == (True, "failure")
    assert run.verdict("cause", "failure", "out_of_reach") == (True, "out_of_reach")
    assert run.verdict("cause", "failure", "slipped") == (False, "slipped")
    assert run.verdict("cause", "failure", None) == (False, None)


@pytest.mark.parametrize(("peaks", "met"), [({}, True), ({"left arm - floor": 4.9}, True), ({"a": 1, "b": 5.1}, False)])
def test_the_largest_unintended_force_counts(peaks: dict[str, float], met: bool) -> None:
    run = Run(Expect(unintended_force=5.0), Truth(peaks=peaks))
    assert run.verdict("unintended_force") == (met, max(peaks.values(), default=0.0))


def test_what_is_not_expected_is_not_judged() -> None:
    failing = Run(Expect(outcome="failure"))
    assert [e.name for e in failing.judge.expectations("failure", None)] == ["outcome"]
    assert [e.name for e in Run().judge.expectations("success", None)] == ["outcome", "end"]


def test_the_last_second_counts_against_a_time_limit() -> None:
    run = Run(Expect(sim_seconds=2.0))
    run.go(2.0)
    assert run.verdict("sim_seconds") == (True, pytest.approx(1.95))
    run.go(0.2)
    assert run.verdict("sim_seconds") == (False, pytest.approx(2.15))


def test_each_hold_after_a_real_loss_is_a_try() -> None:
    run = Run(Expect(tries=2))
    run.go(1.0, fingers=2)
    run.go(0.1, fingers=0)  # regripped
    run.go(1.0, fingers=2)
    assert run.verdict("tries") == (True, 1)
    for tries in (2, 3):
        run.go(1.0, fingers=0)
        run.go(1.0, fingers=2)
        assert run.verdict("tries") == (tries <= 2, tries)


def test_the_longest_delay_counts_and_an_unseen_loss_is_too_late() -> None:
    run = Run(Expect(detection_delay=0.5))
    assert run.verdict("detection_delay") == (True, 0.0)
    for delay, met in ((0.3, True), (0.45, True), (0.6, False)):
        run.go(1.0, fingers=2)
        lost = run.go(1.0, fingers=0)
        assert run.verdict("detection_delay") == (False, None)
        run.notice(LossNotice(lost + delay, "gap"))
        assert run.verdict("detection_delay") == (met, pytest.approx(delay))


def test_the_end_s_place_and_axis_in_the_clip_are_judged_apart() -> None:
    run = Run(Expect(pose_error=PoseError(position=0.002, angle_deg=1.0)))
    assert run.verdict("pose_error.position") == (True, 0.002)
    assert run.verdict("pose_error.angle_deg") == (False, 1.5)
    names = [e.name for e in Run(Expect(pose_error=PoseError(angle_deg=2.0))).judge.expectations("success", None)]
    assert names == ["outcome", "end", "pose_error.angle_deg"]
