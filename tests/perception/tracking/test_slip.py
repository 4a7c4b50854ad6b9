import numpy as np
import pytest

from regrasp.interfaces.reading import GripperReading
from regrasp.perception.tracking.slip import GapTest, distance_slip, seen_at

CENTER = np.array([0.3, -0.1, 0.4])


def fed(gaps: list[float], thickness: float = 0.020) -> GapTest:
    test = GapTest(thickness)
    for i, gap in enumerate(gaps):
        test.feed(GripperReading(i * 0.01, gap))
    return test


def test_distance_beyond_the_thesiss_limit_is_a_slip() -> None:
    assert not distance_slip(CENTER, np.add(CENTER, [0.0, 0.0, -0.199])).detected
    evidence = distance_slip(CENTER, np.add(CENTER, [0.0, 0.0, -0.25]))
    assert (evidence.detected, evidence.by, evidence.limit) == (True, "distance", 0.2)
    assert evidence.value == pytest.approx(0.25)
    assert "0.250 m" in evidence.sentence


def test_a_held_connector_is_never_called_slipped_by_finger_noise() -> None:
    rng = np.random.default_rng(0)
    test = GapTest(0.020)
    alarms = 0
    for i, gap in enumerate(0.019 + rng.normal(0, 3e-4, 20_000)):  # 1 mm backlash, 200 s of readings
        test.feed(GripperReading(i * 0.01, gap))
        alarms += test.evidence().detected
    assert alarms == 0


def test_closed_pads_are_noticed_after_three_readings_of_five() -> None:
    held = [0.020] * 5
    assert not fed(held + [0.004] * 2).evidence().detected
    evidence = fed(held + [0.004] * 3).evidence()
    assert (evidence.detected, evidence.by) == (True, "gap")
    assert "4.0 mm" in evidence.sentence


def test_holding_the_cable_alone_is_a_slip() -> None:
    assert fed([0.007] * 5).evidence().detected


def test_no_verdict_before_the_window_is_full_or_after_a_reset() -> None:
    assert not fed([0.0] * 4).evidence().detected
    test = fed([0.0] * 5)
    assert test.evidence().detected
    test.reset()
    assert not test.evidence().detected


def test_the_same_reading_twice_counts_once() -> None:
    test = GapTest(0.020)
    for _ in range(10):
        test.feed(GripperReading(1.0, 0.003))
    assert not test.evidence().detected


def test_seen_at_a_place() -> None:
    assert seen_at(CENTER, np.add(CENTER, [0.0, 0.03, 0.0]), 0.05).detected
    assert not seen_at(CENTER, np.add(CENTER, [0.0, 0.06, 0.0]), 0.05).detected
