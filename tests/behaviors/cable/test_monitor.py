from pathlib import Path

import numpy as np
import pytest
from fake_services import Stage, seen, unseen
from py_trees.common import Status
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cable.sight import TrackState

MONITOR = '<Monitor name="monitor" period="0.2"/>'


@pytest.fixture
def stage(known: CableKnown, tmp_path: Path) -> Stage:
    stage = Stage(known, tmp_path)
    stage.belief.held = RigidTransform.from_rotation(Rotation.from_euler("z", 90, degrees=True))
    stage.perception.shows = lambda _, t: seen(t, stage.motion.tool_pose.translation)
    return stage


def test_it_looks_at_its_period_and_always_succeeds(stage: Stage) -> None:
    tree = stage.tree(MONITOR)
    for _ in range(21):
        assert stage.run(tree, 0.0) is Status.SUCCESS
        stage.clock.t += 0.05
    assert stage.perception.looks == pytest.approx([0.0, 0.2, 0.4, 0.6, 0.8, 1.0])


def test_the_eye_is_told_which_way_the_held_tip_points(stage: Stage) -> None:
    stage.run(stage.tree(MONITOR), 0.0)
    assert stage.perception.axis == pytest.approx([0.0, 1.0, 0.0])


def test_what_the_hand_hides_is_not_lost_until_the_watch_ends(stage: Stage) -> None:
    stage.run(tree := stage.tree(MONITOR), 0.0)
    stage.perception.shows = lambda _, t: unseen(t)
    stage.clock.t = 2.0
    stage.run(tree, 0.0)
    assert stage.perception.track.state(2.0)[0] is TrackState.HIDDEN_BY_HAND
    assert tree.root.feedback_message.startswith("hidden_by_hand")
    tree.root.stop(Status.INVALID)
    assert stage.perception.track.state(2.0)[0] is TrackState.LOST
    assert stage.perception.axis is None


def test_nothing_held_has_no_axis(stage: Stage) -> None:
    stage.belief.held = None
    stage.perception.axis = np.array([1.0, 0.0, 0.0])
    stage.run(stage.tree(MONITOR), 0.0)
    assert stage.perception.axis is None
