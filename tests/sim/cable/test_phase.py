import numpy as np
import pytest

from regrasp.sim.cable.phase import ConditionTimer, PhaseParameters, PhaseWatch

START = np.array([0.4, 0.1, 0.4])
DT = 0.05
BOTH, NONE = (True, True), (False, False)


class Told:
    """A watch that is told for so long what is true."""

    def __init__(self, parameters: PhaseParameters = PhaseParameters()) -> None:  # noqa: B008
        self.watch, self.now = PhaseWatch(START, parameters), 0.0

    def go(
        self, seconds: float, *, away: float, pads: tuple[bool, bool] = BOTH, speed: float = 0.1, plugged: bool = False,
        stowed: bool = False,
    ) -> "Told":  # fmt: skip
        for _ in range(round(seconds / DT)):
            self.watch.step(self.now, START - [away, 0.0, 0.0], speed, pads, plugged, stowed)
            self.now += DT
        return self


def test_a_whole_run_has_its_phases_in_order() -> None:
    told = Told().go(1.0, away=0.0, plugged=True).go(1.0, away=0.05).go(1.0, away=0.2)
    told.go(1.0, away=0.3, pads=NONE).go(2.0, away=0.4, pads=NONE, speed=0.001).go(1.0, away=0.4)
    # the loss shows 0.2 s after the last touch, the rest after 1 s below 0.01 m/s
    wanted = {"unplugged": 1.0, "carried": 2.0, "lost": 3.2, "settled": 5.0, "regrasped": 6.0}
    assert told.watch.began == pytest.approx(wanted, abs=DT + 1e-9)


def test_a_short_slip_of_one_pad_is_no_loss() -> None:
    told = Told().go(1.0, away=0.2).go(1.0, away=0.2, pads=(True, False)).go(0.1, away=0.2, pads=NONE)
    assert "lost" not in told.go(1.0, away=0.2).watch.began


def test_an_end_that_was_held_near_its_socket_may_be_lost_there() -> None:
    began = Told().go(0.5, away=0.05).go(1.0, away=0.05, pads=NONE).watch.began
    assert set(began) == {"unplugged", "lost"}


def test_what_no_hand_held_is_not_lost() -> None:
    assert "lost" not in Told().go(2.0, away=0.2, pads=NONE).watch.began


def test_what_is_stowed_is_not_lost() -> None:
    assert "lost" not in Told().go(1.0, away=0.2).go(2.0, away=0.3, pads=NONE, stowed=True).watch.began


def test_its_parameters_say_when_an_end_is_lost() -> None:
    patient = Told(PhaseParameters(lost_seconds=2.0))
    assert "lost" not in patient.go(0.5, away=0.2).go(1.5, away=0.3, pads=NONE).watch.began
    assert patient.go(1.0, away=0.3, pads=NONE).watch.began["lost"] == pytest.approx(2.5, abs=DT + 1e-9)


def test_a_condition_s_time_begins_anew_after_a_break() -> None:
    timer = ConditionTimer()
    told = [
        timer.update(now, holds) for now, holds in [(1.0, True), (1.5, True), (2.0, False), (2.5, True), (3.0, True)]
    ]
    assert told == [0.0, 0.5, 0.0, 0.0, 0.5]
    assert timer.since == 2.5
