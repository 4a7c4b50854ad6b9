"""The servo in the habitat's world: why it ends where it cannot come to its target."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from regrasp.app.files.resources import shipped
from regrasp.app.scenario.cell_file import load_cell
from regrasp.app.tasks.printer.studies.hand_placed import HandPlaced
from regrasp.behaviors.printer.approach import approach_steps
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.printer.cause import PrinterCause
from regrasp.interfaces.printer.cell import PrinterCell
from regrasp.interfaces.printer.target import TargetEstimate
from regrasp.interfaces.request import Request, RequestError
from regrasp.motion.printer.servoing import ServoParameters


def cell() -> PrinterCell:
    found = load_cell(shipped("cell")["habitat_open"])
    assert isinstance(found, PrinterCell)
    return found


def placed() -> HandPlaced:
    hand = HandPlaced(cell(), 2)
    hand.place(RigidTransform.from_translation([0.3, 0.0, 0.0]) * hand.goal)
    hand.world.advance(0.5)
    return hand


def served(hand: HandPlaced) -> None:
    [request] = approach_steps(hand.services, "servo", 0.02)
    finish(hand, request)


def finish(hand: HandPlaced, request: Request[Any]) -> None:
    end = hand.world.now() + 30.0
    while not request.poll():
        assert hand.world.now() < end, "the servo does not end"
        hand.world.advance(0.05)


def test_a_part_that_flies_away_is_too_fast() -> None:
    with placed() as hand:
        hand.world.objects.part.float_off(np.array([0.0, -0.2, 0.0]))
        with pytest.raises(RequestError, match="the target moves with") as error:
            served(hand)
        assert error.value.code == PrinterCause.TARGET_TOO_FAST
        hand.world.advance(0.5)
        assert not hand.arm.is_moving()


def test_a_part_that_is_taken_away_on_the_way_is_not_seen() -> None:
    with placed() as hand:
        [request] = approach_steps(hand.services, "servo", 0.02)
        for _ in range(20):
            request.poll()
            hand.world.advance(0.05)
        hand.world.objects.part.take_away()
        with pytest.raises(RequestError, match="0 pixels have its colour") as error:
            finish(hand, request)
        assert error.value.code == PrinterCause.TARGET_NOT_SEEN


def test_a_way_that_is_closed_is_not_gone() -> None:
    """The door stands before the part as the arm believes, though the camera sees the part."""
    with placed() as hand:
        motion: Any = hand.services.motion
        motion.believe_door(0.0)
        with pytest.raises(RequestError, match="door") as error:
            served(hand)
        assert error.value.code == CauseCode.MOTION_BLOCKED
        assert not hand.world.contact_peaks


class _Seen:
    """A target that stands at a pose (4, 4) and is taken at first to fall."""

    why, trouble = "", None

    def __init__(self, hand: HandPlaced, pose: np.ndarray) -> None:
        self._hand, self._pose, self._pictures = hand, pose, 0

    def update(self) -> TargetEstimate:
        self._pictures += 1
        velocity = np.array([0.0, 0.0, -0.09 if self._pictures < 5 else 0.0])
        return TargetEstimate(self._hand.world.now(), self._pose, velocity, 1e-4, 1e-3)


def test_a_velocity_that_is_known_badly_at_first_does_not_bar_the_way() -> None:
    """Where the target would be by its velocity the arm does not come."""
    with placed() as hand:
        motion: Any = hand.services.motion
        before = RigidTransform.from_translation([0.12, 0.0, 0.0]) * hand.goal
        finish(hand, motion.servo(hand.name, _Seen(hand, before.as_matrix()), 0.0))
        assert motion.tool(hand.name).translation == pytest.approx(before.translation, abs=2e-3)


def test_a_hand_that_does_not_come_to_rest_gives_up() -> None:
    with placed() as hand:
        motion: Any = hand.services.motion
        parameters = ServoParameters(tolerance=1e-6, timeout=5.0)
        motion.parameters = motion.parameters.__class__(servo=parameters)
        with pytest.raises(RequestError, match="mm are left") as error:
            served(hand)
        assert error.value.code == CauseCode.TIMED_OUT


def test_a_servo_that_is_cancelled_stops_the_arm() -> None:
    with placed() as hand:
        [request] = approach_steps(hand.services, "servo", 0.02)
        for _ in range(20):
            request.poll()
            hand.world.advance(0.05)
        assert hand.arm.is_moving()
        request.cancel()
        hand.world.advance(0.3)
        assert not hand.arm.is_moving()
        at = hand.tool().translation
        hand.world.advance(0.5)
        assert hand.tool().translation == pytest.approx(at, abs=1e-3)


@pytest.mark.parametrize("speed", [0.02, 0.06])
def test_a_part_that_floats_is_caught_on_the_way(speed: float) -> None:
    """The hand goes along as the jaw closes; then both stand."""
    with HandPlaced(cell(), 3) as hand:
        way = [RigidTransform.from_translation([x, 0.0, 0.0]) for x in (0.12, 0.027)]
        hand.place(way[0] * hand.goal, (hand.goal, hand.goal * way[1]))
        hand.world.advance(0.5)
        part = hand.world.objects.part
        part.float_off(speed * np.array([0.8, -0.5, 0.3]))
        services = hand.services
        tracker = services.perception.part_tracker(
            services.motion.tool_at, lambda: services.gripper.state().gap, hand.world.now()
        )
        finish(hand, services.motion.catch_part(hand.name, tracker, 0.007, ("part", "section")))
        hand.world.advance(1.0)
        inside = hand.tool().translation - part.front().translation
        assert part.front().rotation.inv().apply(inside) == pytest.approx([0.007, 0.0, 0.0], abs=0.005)
        assert services.motion.holds(hand.name, services.known.printer.part.section.size[1])
        assert part.speed() < 0.002
        assert max(hand.world.contact_peaks.values(), default=0.0) < 5.0
