from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fake_services import Stage, seen
from py_trees.common import Status
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cell import pose_along
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
