"""The arm that can do it best takes the connector; where it finds no way the other one tries."""

from collections.abc import Generator
from pathlib import Path

import pytest
from fake_services import FakeMotion, PointCloud, Stage
from py_trees.common import Status
from scipy.spatial.transform import RigidTransform

from regrasp.behaviors.cable.keys import HELD, Found
from regrasp.behaviors.keys import value_of
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.request import Request
from regrasp.motion.failure import PlanningError

REGRASP = '<Regrasp name="regrasp"/>'


class Hindered(FakeMotion):
    """Arms that find no way to the connector, each with its cause."""

    hindered: dict[str, CauseCode]

    def pick_loose(
        self, world_from_connector: RigidTransform, *, point_cloud: PointCloud | None = None
    ) -> Request[None]:
        def steps() -> Generator[None, None, None]:
            yield
            if self.hand in self.hindered:
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
