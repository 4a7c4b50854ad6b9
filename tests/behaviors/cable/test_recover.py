from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fake_services import Stage
from numpy.typing import NDArray
from py_trees.common import Status
from scipy.spatial.transform import RigidTransform

from regrasp.behaviors.cable.keys import Found
from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.frame import Intrinsics, RgbdFrame
from regrasp.motion.failure import PlanningError

WAIT = '<WaitUntilStill name="wait_until_still" time_limit="6.0"/>'
ROOM = '<MakeRoom name="make_room"/>'
K = Intrinsics(64, 48, 50.0, 50.0, 31.5, 23.5)


@pytest.fixture
def stage(known: CableKnown, tmp_path: Path) -> Stage:
    return Stage(known, tmp_path)


def picture(row: int) -> NDArray[np.uint8]:
    """A dark cable, one block high, before wood."""
    rgb = np.full((48, 64, 3), 160, np.uint8)
    rgb[row : row + 4] = 10
    return rgb


def frame(stamp: float, moving: bool) -> RgbdFrame:
    row = 16 + (8 if moving and np.sin(4 * stamp) > 0 else 0)
    return RgbdFrame("rear", 1, stamp, picture(row), np.zeros((48, 64), np.float32), K)


def test_it_waits_out_the_swing(stage: Stage) -> None:
    stage.perception.frames = lambda t: frame(t, moving=t < 3.0)
    assert stage.run(stage.tree(WAIT), 10.0) is Status.SUCCESS
    assert 3.2 < stage.clock.t < 4.5  # a second after the last change, at 2.36 s
    assert len(stage.log.of("still")) == 1


def test_what_never_comes_to_rest_fails_at_the_time_limit(stage: Stage) -> None:
    stage.perception.frames = lambda t: frame(t, moving=True)
    assert stage.run(stage.tree(WAIT), 10.0) is Status.FAILURE
    assert stage.clock.t == pytest.approx(6.0, abs=0.25)
    assert stage.causes[-1].code is CableCause.NOT_STILL


def test_a_frame_from_before_does_not_count(stage: Stage) -> None:
    stage.clock.t = 5.0
    stage.perception.frames = lambda t: replace(frame(t, moving=False), stamp=min(t, 4.9))
    assert stage.run(stage.tree(WAIT), 3.0) is Status.RUNNING


def test_room_is_made_with_the_eye_open_the_jaw_open_first_and_straight_back(stage: Stage) -> None:
    stage.belief.found = Found(RigidTransform.identity(), whole=True, camera="wrist")
    assert stage.run(stage.tree(ROOM), 5.0) is Status.SUCCESS
    [(hand, way)] = stage.motion.shifts
    assert hand == "right"
    assert way == pytest.approx([-0.1, 0.0, 0.0])
    [(arm, goals)] = stage.motion.moves
    assert arm == "right"
    assert goals == pytest.approx(np.array([stage.known.arm("right").sleep]))
    assert len(stage.perception.looks) >= 4
    assert [word for word, _ in stage.motion.grippers["right"].told] == ["open"]
    assert stage.belief.found is None


def test_a_way_that_cannot_be_found_is_the_leaf_s_cause(stage: Stage) -> None:
    stage.motion.error = PlanningError(CauseCode.PLANNING_FAILED, "no way within 4000 draws")
    assert stage.run(stage.tree(ROOM), 5.0) is Status.FAILURE
    assert stage.causes[-1].code is CauseCode.PLANNING_FAILED
    assert "4000 draws" in stage.causes[-1].message


def test_a_leaf_stopped_midway_stops_its_arm_and_one_that_ended_does_not(stage: Stage) -> None:
    tree = stage.tree(ROOM)
    assert stage.run(tree, 0.4) is Status.RUNNING  # the jaw has opened, the hand draws back
    tree.root.stop(Status.INVALID)
    assert stage.motion.cancelled == ["right"]
    assert stage.run(tree, 5.0) is Status.SUCCESS  # begins anew
    tree.root.stop(Status.INVALID)
    assert stage.motion.cancelled == ["right"]


def test_a_way_back_that_is_nowhere_free_is_left_out_and_said_once(stage: Stage) -> None:
    stage.motion.error = PlanningError(CauseCode.MOTION_BLOCKED, "0.03 m straight on the arm is 5 mm in back_panel")
    tree = stage.tree(ROOM)
    while stage.motion.moves == [] and stage.clock.t < 10.0:
        stage.run(tree, 0.05)
    assert [line["why"] for line in stage.log.of("did not draw back")] == [
        "0.03 m straight on the arm is 5 mm in back_panel"
    ]
