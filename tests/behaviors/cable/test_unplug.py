"""Unplugging tries on where the jaw closes on nothing."""

from pathlib import Path

import pytest
from fake_services import FakeGripper, Stage
from py_trees.common import Status

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cause import CauseCode

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
