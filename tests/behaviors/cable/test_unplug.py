"""Unplugging tries on where the jaw closes on nothing."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from fake_services import FakeGripper, Stage
from py_trees.common import Status
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.request import Request
from regrasp.motion.failure import TouchError
from regrasp.motion.robots.contact_guard import Touch

UNPLUG = '<Unplug name="unplug" socket="plugged_into"/>'


@pytest.fixture
def stage(known: CableKnown, tmp_path: Path) -> Stage:
    return Stage(known, tmp_path)


class Misses(FakeGripper):
    """A jaw that closes on nothing so many times, and then on the connector."""

    misses = 0

    def open(self, gap: float) -> None:
        super().open(gap)
        self.gap = gap

    def close(self, force: float) -> None:
        super().close(force)
        self.gap = 0.02 if self.misses <= 0 else 0.001
        self.misses -= 1


def missing(stage: Stage, times: int) -> Misses:
    jaw = Misses(stage.clock, gap=0.05)
    jaw.misses = times
    stage.motion.grippers[stage.motion.known.cable.hand] = jaw
    return jaw


def test_a_miss_does_not_end_it(stage: Stage) -> None:
    jaw = missing(stage, 2)
    assert stage.run(stage.tree(UNPLUG), 60.0) is Status.SUCCESS
    assert [word for word, _ in jaw.told if word == "close"] == ["close"] * 3
    assert len(stage.log.of("tries again")) == 2
    assert len(stage.log.of("grasped")) == 1
    hand, goals = stage.motion.moves[-1]
    assert hand == stage.motion.known.cable.hand
    assert goals[0] == pytest.approx(stage.motion.known.arm(hand).sleep)  # it leaves before it looks for another grasp


def test_three_misses_do(stage: Stage) -> None:
    missing(stage, 3)
    assert stage.run(stage.tree(UNPLUG), 60.0) is Status.FAILURE
    assert stage.causes[-1].code is CauseCode.GRASP_EMPTY


@pytest.mark.parametrize(("touches", "status"), [(2, Status.SUCCESS), (6, Status.FAILURE)])
def test_arms_that_touch_something_on_each_way_try_again(
    stage: Stage, monkeypatch: pytest.MonkeyPatch, touches: int, status: Status
) -> None:
    left = touches
    missing(stage, 0)

    def touching(plug: RigidTransform, *, point_cloud: object = None) -> Request[None]:
        nonlocal left
        left -= 1
        return Request(raising() if left >= 0 else iter(()))

    def raising() -> Iterator[None]:
        yield
        raise TouchError("touched something", Touch(0.0, np.zeros(6), np.zeros(6), np.ones(6)))

    monkeypatch.setattr(stage.motion, "pick_plug", touching)
    assert stage.run(stage.tree(UNPLUG), 60.0) is status
