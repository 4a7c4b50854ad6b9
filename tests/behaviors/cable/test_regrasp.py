"""The arm that can do it best takes the connector; where it finds no way the other one tries."""

from collections.abc import Generator
from pathlib import Path

import numpy as np
import pytest
from fake_services import FakeMotion, PointCloud, Stage, seen
from py_trees.common import Status
from scipy.spatial.transform import RigidTransform

from regrasp.behaviors.cable.keys import HELD, NOTICES, Found
from regrasp.behaviors.keys import value_of
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.request import Request
from regrasp.motion.failure import PlanningError

REGRASP = '<Regrasp name="regrasp"/>'


class Hindered(FakeMotion):
    """Arms that find no way to the connector, each with its cause."""

    hindered: dict[str, CauseCode]
    lifted_place: float = 0.3  # m, the height from which on nothing hinders

    def pick_loose(
        self, world_from_connector: RigidTransform, *, point_cloud: PointCloud | None = None
    ) -> Request[None]:
        def steps() -> Generator[None, None, None]:
            yield
            if self.hand in self.hindered and world_from_connector.translation[2] < self.lifted_place:
                raise PlanningError(self.hindered[self.hand], f"the {self.hand} arm has no way")

        return Request(steps())


@pytest.fixture
def stage(known: CableKnown, tmp_path: Path) -> Stage:
    stage = Stage(known, tmp_path)
    motion = Hindered(stage.clock, known)
    motion.hindered, motion.hands = {}, ["left", "right"]
    for gripper in motion.grippers.values():
        gripper.gap = 0.02
    stage.motion = stage.services.motion = motion
    stage.belief.found = Found(RigidTransform.identity(), True, "rear")
    return stage


def hindered(stage: Stage, **causes: CauseCode) -> Hindered:
    assert isinstance(stage.motion, Hindered)
    stage.motion.hindered = causes
    return stage.motion


def test_the_best_arm_is_the_hand_from_then_on(stage: Stage) -> None:
    motion = hindered(stage)
    assert motion.hand == "right"
    assert stage.run(stage.tree(REGRASP), 20.0) is Status.SUCCESS
    assert motion.hand == "left"
    assert "close" in [word for word, _ in motion.grippers["left"].told]
    assert "close" not in [word for word, _ in motion.grippers["right"].told]
    assert value_of(HELD, None) is not None


def test_a_jaw_that_closes_on_nothing_may_have_lost_the_connector(stage: Stage) -> None:
    for gripper in stage.motion.grippers.values():
        gripper.gap = 0.0
    assert stage.run(stage.tree(REGRASP), 60.0) is Status.FAILURE
    assert stage.causes[-1].code is CauseCode.GRASP_EMPTY
    assert [notice.by for notice in value_of(NOTICES)] == ["grasp"]
    assert value_of(HELD, None) is None


def test_an_arm_without_a_way_goes_to_sleep_before_the_other_one_tries(stage: Stage) -> None:
    motion = hindered(stage, left=CauseCode.NO_COLLISION_FREE_GOAL)
    assert stage.run(stage.tree(REGRASP), 20.0) is Status.SUCCESS
    assert motion.hand == "right"
    arm, goals = motion.moves[0]
    assert arm == "left"
    assert goals[0] == pytest.approx(motion.known.arm("left").sleep)
    assert len(stage.log.of("left to the other arm")) == 1


def test_where_no_arm_has_a_way_the_last_one_says_why(stage: Stage) -> None:
    hindered(stage, left=CauseCode.OUT_OF_REACH, right=CauseCode.PLANNING_FAILED)
    assert stage.run(stage.tree(REGRASP), 20.0) is Status.FAILURE
    assert stage.causes[-1].code is CauseCode.PLANNING_FAILED


def test_a_broken_arm_is_not_replaced_by_the_other(stage: Stage) -> None:
    motion = hindered(stage, left=CauseCode.ARM_FAILED)
    assert stage.run(stage.tree(REGRASP), 20.0) is Status.FAILURE
    assert stage.causes[-1].code is CauseCode.ARM_FAILED
    assert not motion.moves


def test_what_no_arm_can_take_is_lifted_by_its_cable_and_taken_by_the_other_arm(stage: Stage) -> None:
    motion = hindered(stage, left=CauseCode.NO_COLLISION_FREE_GOAL, right=CauseCode.OUT_OF_REACH)
    stage.perception.shows = lambda camera, stamp: seen(stamp, np.array([0.4, 0.0, 0.4]), camera)
    assert stage.run(stage.tree(REGRASP), 60.0) is Status.SUCCESS
    assert [fields["arm"] for fields in stage.log.of("lifted by its cable")] == ["left"]
    assert motion.hand == "right"
    assert not motion.pulled
    assert value_of(HELD, None) is not None


@pytest.mark.parametrize(
    ("code", "status"), [(CauseCode.NO_COLLISION_FREE_GOAL, Status.SUCCESS), (CauseCode.ARM_FAILED, Status.FAILURE)]
)
def test_an_arm_that_cannot_leave_the_cable_stays_there_and_the_other_holds_the_connector(
    stage: Stage, code: CauseCode, status: Status
) -> None:
    motion = hindered(stage, left=CauseCode.NO_COLLISION_FREE_GOAL, right=CauseCode.OUT_OF_REACH)
    stage.perception.shows = lambda camera, stamp: seen(stamp, np.array([0.4, 0.0, 0.4]), camera)

    def no_way(arm: str) -> Request[None]:
        def steps() -> Generator[None, None, None]:
            yield
            raise PlanningError(code, "none of 1 goals keeps 5 mm: the best has 0 mm to other arm")

        return Request(steps())

    motion.let_go_of_cable = no_way  # type: ignore[method-assign]
    assert stage.run(stage.tree(REGRASP), 60.0) is status
    assert len(stage.log.of("stays beside the hand")) == (status is Status.SUCCESS)
    assert value_of(HELD, None) is not None


def test_what_is_not_seen_once_lifted_is_let_go(stage: Stage) -> None:
    motion = hindered(stage, left=CauseCode.NO_COLLISION_FREE_GOAL, right=CauseCode.NO_COLLISION_FREE_GOAL)
    assert stage.run(stage.tree(REGRASP), 60.0) is Status.FAILURE
    assert len(stage.log.of("lifted by its cable")) == 1
    assert stage.causes[-1].code is CauseCode.NO_COLLISION_FREE_GOAL
    assert not motion.pulled


def test_what_cannot_be_taken_once_lifted_is_brought_elsewhere_and_let_go_there(stage: Stage) -> None:
    nowhere = CauseCode.NO_COLLISION_FREE_GOAL
    motion = hindered(stage, left=nowhere, right=nowhere)  # and no camera sees it then
    assert stage.run(stage.tree(REGRASP), 120.0) is Status.FAILURE
    assert motion.brought == 3
    assert not motion.pulled


def test_where_the_way_is_blocked_again_the_cable_is_pulled(stage: Stage) -> None:
    blocked, tree = CauseCode.MOTION_BLOCKED, stage.tree(REGRASP)
    for lifted in (0, 1):
        hindered(stage, left=blocked, right=blocked)
        assert stage.run(tree, 120.0) is Status.FAILURE
        assert len(stage.log.of("lifted by its cable")) == lifted


def test_where_there_is_a_grasp_but_no_way_to_it_nothing_pulls_at_the_cable(stage: Stage) -> None:
    hindered(stage, left=CauseCode.PLANNING_FAILED, right=CauseCode.PLANNING_FAILED)
    assert stage.run(stage.tree(REGRASP), 60.0) is Status.FAILURE
    assert not stage.log.of("lifted by its cable")


def test_an_arm_that_breaks_as_it_pulls_is_the_cause_that_is_told(stage: Stage) -> None:
    motion = hindered(stage, left=CauseCode.OUT_OF_REACH, right=CauseCode.OUT_OF_REACH)

    def breaks(world_from_connector: RigidTransform) -> Request[str]:
        def steps() -> Generator[None, None, str]:
            yield
            raise PlanningError(CauseCode.ARM_FAILED, "the left arm does not follow")

        return Request(steps())

    motion.pull_cable = breaks  # type: ignore[method-assign]
    assert stage.run(stage.tree(REGRASP), 60.0) is Status.FAILURE
    assert stage.causes[-1].code is CauseCode.ARM_FAILED
