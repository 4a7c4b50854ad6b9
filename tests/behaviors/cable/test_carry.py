"""What cannot be carried is let go, and taken otherwise."""

from pathlib import Path

import pytest
from fake_services import Stage
from py_trees.common import Status
from scipy.spatial.transform import RigidTransform

from regrasp.behaviors.cable.keys import NOTICES, LossNotice
from regrasp.behaviors.keys import value_of
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cause import CauseCode
from regrasp.motion.failure import PlanningError

CARRY = '<Carry name="carry"/>'


@pytest.fixture
def stage(known: CableKnown, tmp_path: Path) -> Stage:
    stage = Stage(known, tmp_path)
    stage.belief.held = RigidTransform.identity()
    return stage


def carried(stage: Stage, code: CauseCode) -> list[str]:
    """What the jaw was told while a carry failed with this cause."""
    stage.motion.error = PlanningError(code, "no way")
    # The jaw opens whatever becomes of the arm.
    stage.motion.let_go = lambda: stage.motion.release(stage.motion.hand, 0.025)  # type: ignore[method-assign]
    before = len(stage.motion.grippers[stage.motion.hand].told)
    assert stage.run(stage.tree(CARRY), 10.0) is Status.FAILURE
    return [word for word, _ in stage.motion.grippers[stage.motion.hand].told[before:]]


def test_the_first_carry_that_fails_leaves_it_in_the_hand(stage: Stage) -> None:
    assert carried(stage, CauseCode.PLANNING_FAILED) == []
    assert stage.belief.held is not None


def test_the_second_lets_it_fall(stage: Stage) -> None:
    carried(stage, CauseCode.PLANNING_FAILED)
    assert carried(stage, CauseCode.MOTION_BLOCKED) == ["open"]


def test_what_is_held_so_that_it_can_be_brought_nowhere_is_let_fall_at_once(stage: Stage) -> None:
    assert carried(stage, CauseCode.OUT_OF_REACH) == ["open"]


def test_a_broken_arm_lets_nothing_fall(stage: Stage) -> None:
    for _ in range(3):
        assert carried(stage, CauseCode.ARM_FAILED) == []
    assert stage.belief.held is not None
    assert value_of(NOTICES) == ()


def test_the_cable_is_bent_by_force_only_once_the_connector_was_let_fall(stage: Stage) -> None:
    for notices in ((LossNotice(1.0, "gap"),), (LossNotice(1.0, "gap"), LossNotice(2.0, "hand"))):
        stage.belief.notices = notices
        stage.run(stage.tree(CARRY), 10.0)
    assert stage.motion.forced == [False, True]
