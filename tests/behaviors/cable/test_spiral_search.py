from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from fake_services import Stage, seen, unseen
from py_trees.common import Status

from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.cell import FixedMount
from regrasp.motion.cable.viewing import ViewingParameters
from regrasp.motion.cable.viewpoints import spiral
from regrasp.motion.failure import PlanningError
from regrasp.perception.pose.estimate import Estimate, NoEstimate
from regrasp.perception.pose.segmentation import NotSeen

SPIRAL = ViewingParameters().spiral
PLACE = np.array([0.40, 0.10, 0.25])


@pytest.fixture
def stage(known: CableKnown, tmp_path: Path) -> Stage:
    stage = Stage(known, tmp_path)
    stage.perception.track.feed(seen(0.0, PLACE))
    stage.perception.shows = lambda _, t: unseen(t, "wrist")
    return stage


def search(seconds: float) -> str:
    return f'<SpiralSearch name="spiral_search" time_limit="{seconds}" look_seconds="1.0"/>'


def eye(stage: Stage, i: int) -> np.ndarray:
    """Where the camera went in its i-th move, (3,) m."""
    arm, goals = stage.motion.moves[i]
    assert arm == "left"
    return np.asarray(goals[0, :3])


def places(stage: Stage, n: int) -> list[np.ndarray]:
    """Where the camera stands at the first stops of the spiral round the last place."""
    rear = stage.known.camera("rear")
    assert isinstance(rear.mount, FixedMount)
    last = stage.perception.track.last
    assert last is not None
    stops = spiral(last.position, rear.mount.world_from_camera, rear.intrinsics, SPIRAL)
    return [stop.world_from_camera.translation for stop in islice(stops, n)]


def test_it_begins_where_the_end_was_last_seen_and_ends_with_the_find(stage: Stage) -> None:
    stage.perception.shows = lambda _, t: seen(t, PLACE, "wrist") if len(stage.motion.moves) == 2 else unseen(t)
    expected = places(stage, 2)
    assert stage.run(stage.tree(search(300)), 60.0) is Status.SUCCESS
    assert len(stage.motion.moves) == 2
    assert [eye(stage, i) for i in range(2)] == [pytest.approx(p) for p in expected]
    assert stage.belief.found is not None
    assert stage.belief.found.camera == "wrist"
    assert stage.belief.found.world_from_connector.translation == pytest.approx(PLACE, abs=1e-3)
    [found] = stage.log.of("found")
    assert (found["looked"], found["skipped"]) == (2, [])


def test_an_end_never_seen_is_sought_from_the_panel_s_middle(known: CableKnown, tmp_path: Path) -> None:
    stage = Stage(known, tmp_path)
    stage.run(stage.tree(search(300)), 0.1)
    panel = next(box for box in known.boxes if box.name == "back_panel")
    assert stage.log.of("search") == [
        {
            "node": stage.log.of("search")[0]["node"],
            "start": np.round(panel.center, 3).tolist(),
            "last_seen": False,
            "rest_views": 0,
        }
    ]


def test_a_glimpse_is_no_find(stage: Stage) -> None:
    stage.perception.shows = lambda _, t: seen(t, PLACE, "wrist") if 0.6 <= t < 0.73 else unseen(t)  # two frames
    assert stage.run(stage.tree(search(10)), 60.0) is Status.FAILURE
    assert stage.belief.found is None


def test_what_shows_too_little_is_looked_at_next(stage: Stage) -> None:
    place = PLACE + np.array([0.0, 0.12, -0.05])
    little = replace(unseen(0.0, "wrist"), reason=NotSeen.TOO_SMALL, weak_detection=place)

    def shows(_: str, t: float) -> Estimate | NoEstimate:
        return replace(little, stamp=t) if len(stage.motion.moves) == 1 else seen(t, place, "wrist")

    stage.perception.shows = shows
    first = places(stage, 1)[0]
    assert stage.run(stage.tree(search(300)), 60.0) is Status.SUCCESS
    assert len(stage.motion.moves) == 2
    assert eye(stage, 0) == pytest.approx(first)
    assert np.linalg.norm(eye(stage, 1) - place) == pytest.approx(SPIRAL.distance)
    assert stage.belief.found is not None
    assert stage.belief.found.world_from_connector.translation == pytest.approx(place, abs=1e-3)


def test_stops_out_of_reach_are_skipped_and_counted(stage: Stage) -> None:
    second = places(stage, 2)[1]
    stage.motion.reachable = lambda pose: bool(np.linalg.norm((pose.translation - second)[1:]) > 0.1)
    assert stage.run(stage.tree(search(12)), 60.0) is Status.FAILURE
    [line] = stage.log.of("not found")
    assert 1 in line["skipped"]
    assert all(np.linalg.norm((eye(stage, i) - second)[1:]) > 0.1 for i in range(line["looked"]))
    assert "out of reach" in stage.causes[-1].message


def test_a_stop_out_of_reach_is_looked_at_from_nearer(stage: Stage) -> None:
    first = places(stage, 1)[0]
    stage.motion.reachable = lambda pose: pose.translation[0] > first[0] + 0.04
    stage.run(stage.tree(search(300)), 0.3)
    assert eye(stage, 0) == pytest.approx(np.add(first, [0.05, 0.0, 0.0]), abs=1e-6)


def test_a_way_that_cannot_be_planned_skips_the_stop(stage: Stage) -> None:
    stage.motion.error = PlanningError(CauseCode.PLANNING_FAILED, "no way")
    tree = stage.tree(search(2.0))
    assert stage.run(tree, 60.0) is Status.FAILURE
    [line] = stage.log.of("not found") or [{"looked": 0}]
    assert line["looked"] == 0


def test_it_ends_at_its_time_limit_with_the_arm_asleep(stage: Stage) -> None:
    assert stage.run(stage.tree(search(10.0)), 60.0) is Status.FAILURE
    assert 10.0 < stage.clock.t < 12.5  # the stop under way is looked from to its end
    arm, goals = stage.motion.moves[-1]
    assert arm == "left"
    assert goals == pytest.approx(np.array([stage.known.arm("left").sleep]))
    [cause] = stage.causes
    assert cause.code is CableCause.SEARCH_EXHAUSTED
    assert stage.belief.found is None


def test_stopped_midway_it_stops_looking(stage: Stage) -> None:
    tree = stage.tree(search(300))
    stage.run(tree, 5.0)
    looks = len(stage.perception.looks)
    tree.root.stop(Status.INVALID)
    stage.clock.t += 10.0
    assert len(stage.perception.looks) == looks
    assert stage.run(tree, 0.1) is Status.RUNNING
    assert len(stage.log.of("search")) == 2  # begins anew


def test_stopped_on_its_way_to_sleep_it_stops_the_arm(stage: Stage) -> None:
    tree = stage.tree(search(1.0))
    while len(stage.motion.moves) < 2:  # to the one stop for which there is time, and to sleep
        stage.run(tree, 0.0)
        stage.clock.t += 0.05
    tree.root.stop(Status.INVALID)
    assert stage.motion.cancelled == ["left"]


def test_after_a_search_in_vain_the_next_begins_at_the_panel_s_middle(stage: Stage) -> None:
    tree = stage.tree(search(2.0))
    for _ in range(3):
        assert stage.run(tree, 60.0) is Status.FAILURE
    assert [line["last_seen"] for line in stage.log.of("search")] == [True, False, True]
