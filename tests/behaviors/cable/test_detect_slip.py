from pathlib import Path

import numpy as np
import pytest
from fake_services import Stage, seen, unseen
from py_trees.common import Status
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cable.cell import CableKnown

WATCH = """<Sequence name="watch" memory="false">
<Monitor name="monitor" period="0.1"/><DetectSlip name="detect_slip"/></Sequence>"""


@pytest.fixture
def stage(known: CableKnown, tmp_path: Path) -> Stage:
    stage = Stage(known, tmp_path)
    stage.belief.held = RigidTransform.identity()
    return stage


def test_a_connector_in_the_hand_and_in_sight_is_watched_on(stage: Stage) -> None:
    stage.perception.shows = lambda _, t: seen(t, stage.motion.tool_pose.translation)
    assert stage.run(stage.tree(WATCH), 3.0) is Status.RUNNING
    assert stage.belief.held is not None
    assert not stage.belief.notices


def test_the_finger_gap_tells_of_an_end_that_stays_near(stage: Stage) -> None:
    stage.perception.shows = lambda _, t: seen(t, stage.motion.tool_pose.translation)
    tree = stage.tree(WATCH)
    stage.run(tree, 1.0)
    stage.motion.grippers["right"].gap = 0.003
    lost_at = stage.clock.t
    assert stage.run(tree, 1.0) is Status.FAILURE
    [notice] = stage.belief.notices
    assert notice.by == "gap"
    assert notice.at == pytest.approx(lost_at + 0.10, abs=0.06)  # the median of five readings, one a tick
    [cause] = stage.causes
    assert cause.code is CableCause.SLIPPED
    assert cause.node.endswith("watch/detect_slip")
    assert "3.0 mm apart" in cause.message
    assert stage.belief.held is None
    assert [line["by"] for line in stage.log.of("slip")] == ["gap"]


def test_an_end_seen_far_from_the_hand_has_slipped(stage: Stage) -> None:
    away = stage.motion.tool_pose.translation + np.array([0.0, 0.25, 0.0])
    stage.perception.shows = lambda _, t: seen(t, stage.motion.tool_pose.translation if t < 1.0 else away)
    assert stage.run(stage.tree(WATCH), 3.0) is Status.FAILURE
    assert [notice.by for notice in stage.belief.notices] == ["distance"]
    assert 1.0 <= stage.clock.t <= 1.3


def test_an_end_19_cm_away_has_not_slipped_by_the_thesis_s_limit(stage: Stage) -> None:
    near = stage.motion.tool_pose.translation + np.array([0.0, 0.19, 0.0])
    stage.perception.shows = lambda _, t: seen(t, near)
    assert stage.run(stage.tree(WATCH), 3.0) is Status.RUNNING


def test_an_end_that_the_hand_hides_has_not_slipped(stage: Stage) -> None:
    begin = stage.motion.tool_pose.translation
    stage.perception.shows = lambda _, t: seen(t, begin) if t < 0.5 else unseen(t)
    tree = stage.tree(WATCH)
    stage.run(tree, 1.0)
    stage.motion.tool_pose = RigidTransform.from_translation(
        np.add(begin, [0.0, 0.5, 0.0])
    )  # far from where it was last seen
    assert stage.run(tree, 4.0) is Status.RUNNING
    assert not stage.belief.notices


def test_a_second_watch_forgets_the_readings_of_the_first(stage: Stage) -> None:
    stage.perception.shows = lambda _, t: seen(t, stage.motion.tool_pose.translation)
    tree = stage.tree(WATCH)
    stage.motion.grippers["right"].gap = 0.003
    assert stage.run(tree, 1.0) is Status.FAILURE
    stage.belief.held = RigidTransform.identity()
    stage.motion.grippers["right"].gap = 0.02
    assert stage.run(tree, 1.0) is Status.RUNNING
    assert len(stage.belief.notices) == 1
