from pathlib import Path

import numpy as np
import pytest
from fake_services import Seen, Stage, seen, unseen
from py_trees.common import Status

from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cable.cell import CableKnown

CHECK = '<CheckCameras name="check_cameras" seconds="1.5"/>'
PLACE = np.array([0.35, 0.1, 0.2])


@pytest.fixture
def stage(known: CableKnown, tmp_path: Path) -> Stage:
    return Stage(known, tmp_path)


def test_an_end_in_sight_is_found_without_a_search(stage: Stage) -> None:
    stage.perception.shows = lambda _, t: seen(t, PLACE)
    assert stage.run(stage.tree(CHECK), 5.0) is Status.SUCCESS
    assert stage.belief.found is not None
    assert stage.belief.found.world_from_connector.translation == pytest.approx(PLACE, abs=1e-3)
    assert (stage.belief.found.camera, stage.belief.found.whole) == ("rear", True)
    assert stage.clock.t == pytest.approx(1.5, abs=0.06)


def test_a_part_in_sight_is_found_but_not_sure(stage: Stage) -> None:
    stage.perception.shows = lambda _, t: seen(t, PLACE, whole=False)
    assert stage.run(stage.tree(CHECK), 5.0) is Status.SUCCESS
    assert stage.belief.found is not None
    assert not stage.belief.found.whole


def frozen(_camera: str, _stamp: float) -> Seen:
    return seen(2.0, PLACE)


def vanishes(_camera: str, stamp: float) -> Seen:
    return seen(stamp, PLACE) if stamp < 2.8 else unseen(stamp)


def never(_camera: str, stamp: float) -> Seen:
    return unseen(stamp)


@pytest.mark.parametrize(("shows", "why"), [(never, "never seen"), (vanishes, "s ago"), (frozen, "0.000 mm")])
def test_an_end_that_is_not_there_not_fresh_or_not_live_must_be_searched(stage: Stage, shows: object, why: str) -> None:
    stage.perception.shows = shows  # type: ignore[assignment]
    stage.clock.t = 2.0
    assert stage.run(stage.tree(CHECK), 5.0) is Status.FAILURE
    [cause] = stage.causes
    assert cause.code is CableCause.CONNECTOR_NOT_FOUND
    assert why in cause.message
    assert stage.belief.found is None
