from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fake_services import Seen, Stage, seen, unseen
from py_trees.common import Status
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.behaviors.cable.keys import HELD as HELD_KEY
from regrasp.behaviors.cable.keys import NOTICES
from regrasp.behaviors.keys import value_of
from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.cell import pose_along
from regrasp.motion.failure import PlanningError
from regrasp.perception.pose.estimate import Estimate


@pytest.fixture
def stage(known: CableKnown, tmp_path: Path) -> Stage:
    return Stage(known, tmp_path)


def lying(stamp: float, connector: RigidTransform) -> Estimate:
    """The rear camera sees the whole connector in this pose."""
    position, axis = connector.translation, connector.rotation.apply([1.0, 0.0, 0.0])
    return replace(seen(stamp, position), axis=axis, world_from_connector=connector)


def inserted(stage: Stage, held: RigidTransform, connector: RigidTransform) -> RigidTransform:
    """What is believed of the connector in the hand, held so until it was seen, after the insertion."""
    stage.belief.held = held
    stage.perception.shows = lambda _, t: lying(t, connector)
    assert stage.run(stage.tree('<Insert name="insert"/>'), 60.0) is Status.SUCCESS
    assert stage.belief.held is not None
    return stage.belief.held


def test_what_the_camera_sees_corrects_how_it_lies_in_the_hand(stage: Stage) -> None:
    held = RigidTransform.from_components([0.0, 0.0, 0.01], Rotation.from_euler("z", 90, degrees=True))
    really = RigidTransform.from_components([0.0, 0.005, 0.01], Rotation.from_euler("z", 105, degrees=True))
    believed = inserted(stage, held, stage.motion.tool_pose * really)
    assert believed.translation == pytest.approx(really.translation, abs=1e-3)
    assert (believed.rotation.inv() * really.rotation).magnitude() < 0.01


def test_it_does_not_turn_round_in_the_jaw(stage: Stage) -> None:
    """A finger beside it may look like the cable."""
    held = RigidTransform.from_components([0.0, 0.0, 0.01], Rotation.from_euler("z", 90, degrees=True))
    mistaken = stage.motion.tool_pose * held * RigidTransform.from_rotation(Rotation.from_euler("z", 165, degrees=True))
    x, y, z = mistaken.translation.tolist()
    ax, ay, az = mistaken.rotation.apply([1.0, 0.0, 0.0]).tolist()
    believed = inserted(stage, held, pose_along((x, y, z), (ax, ay, az)))
    axis, before = (pose.rotation.apply([1.0, 0.0, 0.0]) for pose in (believed, held))
    assert np.rad2deg(np.arccos(axis @ before)) == pytest.approx(15.0, abs=0.5)


INSERT = '<Insert name="insert"/>'
HELD = RigidTransform.from_components([0.0, 0.0, 0.01], Rotation.from_euler("z", 90, degrees=True))
TURNED = RigidTransform.from_components([0.0, 0.0, 0.01], Rotation.from_euler("z", 105, degrees=True))


def hidden(stage: Stage) -> None:
    """The hand holds the connector, and hides it from the overview camera; the other arm's would see it turned."""

    def shows(camera: str, stamp: float) -> Seen:
        return unseen(stamp) if camera == "rear" else lying(stamp, stage.motion.tool_pose * TURNED)

    stage.belief.held, stage.perception.shows = HELD, shows


def test_what_the_clip_holds_at_once_is_pulled_once(stage: Stage) -> None:
    inserted(stage, HELD, stage.motion.tool_pose * HELD)
    assert [attempt for attempt, _ in stage.motion.inserted] == [0]
    assert stage.log.of("pulled at the clip")[0]["holds"] is True


def test_what_the_clip_does_not_hold_is_looked_at_again_and_inserted_otherwise(stage: Stage) -> None:
    stage.motion.clip_stiffness = lambda insertion: 50.0 if insertion < 3 else 1500.0
    inserted(stage, HELD, stage.motion.tool_pose * HELD)
    assert [attempt for attempt, _ in stage.motion.inserted] == [0, 1, 2]
    assert [told["holds"] for told in stage.log.of("pulled at the clip")] == [False, False, True]
    assert len(stage.log.of("connector in the hand")) == 3


def test_when_no_try_is_left_it_fails_and_lets_it_fall(stage: Stage) -> None:
    stage.belief.held, stage.motion.clip_stiffness = HELD, lambda insertion: 50.0
    stage.perception.shows = lambda _, t: lying(t, stage.motion.tool_pose * HELD)
    assert stage.run(stage.tree(INSERT), 60.0) is Status.FAILURE
    [cause] = stage.causes
    assert cause.code == CableCause.NOT_STOWED
    assert "rose by 50 N/m" in cause.message
    assert len(stage.motion.inserted) == stage.motion.insertions
    assert value_of(HELD_KEY, None) is None
    assert [word for word, _ in stage.motion.grippers[stage.motion.hand].told] == ["open"]
    assert [notice.by for notice in value_of(NOTICES)] == ["hand"]


def test_where_the_way_is_blocked_again_it_is_let_fall_and_taken_otherwise(stage: Stage) -> None:
    stage.belief.held = HELD
    stage.perception.shows = lambda _, t: lying(t, stage.motion.tool_pose * HELD)
    stage.motion.error = PlanningError(CauseCode.MOTION_BLOCKED, "the arm touched something")
    # The jaw opens whatever becomes of the arm.
    stage.motion.let_go = lambda: stage.motion.release(stage.motion.hand, 0.025)  # type: ignore[method-assign]
    told = []
    for _ in range(2):
        assert stage.run(stage.tree(INSERT), 60.0) is Status.FAILURE
        told.append([word for word, _ in stage.motion.grippers[stage.motion.hand].told])
    assert told == [[], ["open"]]


def test_where_the_hand_hides_it_the_other_arm_looks_and_goes_back_to_sleep(stage: Stage) -> None:
    hidden(stage)
    assert stage.run(stage.tree(INSERT), 60.0) is Status.SUCCESS
    [(_, held)] = stage.motion.inserted
    assert (held.rotation.inv() * TURNED.rotation).magnitude() < 0.01
    arm = stage.known.search_mount.arm
    assert [moved for moved, _ in stage.motion.moves] == [arm, arm]
    assert stage.motion.moves[-1][1][0] == pytest.approx(stage.known.arm(arm).sleep)


def test_where_no_view_is_free_it_is_inserted_as_believed(stage: Stage) -> None:
    hidden(stage)
    stage.motion.reachable = lambda pose: False
    assert stage.run(stage.tree(INSERT), 60.0) is Status.SUCCESS
    [(_, held)] = stage.motion.inserted
    assert held.translation == pytest.approx(HELD.translation)
    [told] = stage.log.of("no look in the hand")
    assert "no free place" in told["why"]


def test_what_was_lost_while_the_other_arm_looked_is_not_inserted(stage: Stage) -> None:
    hidden(stage)
    tree = stage.tree(INSERT)
    stage.run(tree, 1.2)
    stage.belief.held = None
    assert stage.run(tree, 10.0) is Status.FAILURE
    assert [cause.code for cause in stage.causes] == [CableCause.SLIPPED]
    assert not stage.motion.inserted
