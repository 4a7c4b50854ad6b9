from pathlib import Path

import numpy as np
import pytest
from fake_services import Seen, Stage, seen, unseen
from py_trees.common import Status
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cable.cell import CableKnown

LOOK = '<LookAtStow name="look_at_stow"/>'


@pytest.fixture
def stage(known: CableKnown, tmp_path: Path) -> Stage:
    return Stage(known, tmp_path)


def test_an_end_in_the_clip_is_stowed(stage: Stage) -> None:
    seat = np.array(stage.known.cable.clip.seat)
    stage.perception.shows = lambda _, t: seen(t, np.add(seat, [0.0, 0.02, 0.01]))
    assert stage.run(stage.tree(LOOK), 3.0) is Status.SUCCESS
    assert not stage.belief.notices


def beside(stage: Stage, stamp: float) -> Seen:
    return seen(stamp, np.add(stage.known.cable.clip.seat, [0.0, 0.0, -0.10]))


def nowhere(_stage: Stage, stamp: float) -> Seen:
    return unseen(stamp)


def stale(stage: Stage, _stamp: float) -> Seen:
    return seen(0.0, np.array(stage.known.cable.clip.seat))


@pytest.mark.parametrize("shows", [beside, nowhere, stale])
def test_an_end_that_is_not_there_is_noticed_once(stage: Stage, shows: object) -> None:
    stage.clock.t = 1.0
    stage.perception.shows = lambda _, t: shows(stage, t)  # type: ignore[operator]
    assert stage.run(stage.tree(LOOK), 3.0) is Status.FAILURE
    [notice] = stage.belief.notices
    assert notice.by == "place"
    assert notice.at == pytest.approx(stage.clock.t)
    assert [cause.code for cause in stage.causes] == [CableCause.NOT_STOWED]


@pytest.mark.parametrize("rear_sees", [0.06, None])
@pytest.mark.parametrize(
    ("wrist_sees", "status"), [(0.0, Status.SUCCESS), (0.10, Status.FAILURE), (None, Status.FAILURE)]
)
def test_an_end_that_is_seen_in_part_elsewhere_or_not_at_all_is_looked_at_with_the_other_camera(
    stage: Stage, rear_sees: float | None, wrist_sees: float | None, status: Status
) -> None:
    seat = np.array(stage.known.cable.clip.seat)

    def shows(camera: str, t: float) -> Seen:
        above = rear_sees if camera == "rear" else wrist_sees
        return unseen(t) if above is None else seen(t, np.add(seat, [0.0, 0.0, above]), camera, whole=camera != "rear")

    stage.perception.shows = shows
    assert stage.run(stage.tree(LOOK), 20.0) is status
    assert bool(stage.belief.notices) is (status is Status.FAILURE)


def test_letting_go_opens_the_jaw_and_believes_nothing_held(stage: Stage) -> None:
    stage.belief.held = RigidTransform.identity()
    tree = stage.tree('<LetGo name="let_go"/>')
    stage.run(tree, 0.2)
    assert stage.motion.grippers["right"].told[0][0] == "open"
    assert not stage.motion.moves  # the arm waits until the jaw is open
    assert stage.belief.held is None
