import numpy as np
from fake_devices import Clock, FakeGripper

from regrasp.interfaces.reading import GripperReading
from regrasp.motion.grasping.gap_test import GapTest, GripWatch


def fed(gaps: list[float], thickness: float = 0.020) -> GapTest:
    test = GapTest(thickness)
    for i, gap in enumerate(gaps):
        test.feed(GripperReading(i * 0.01, gap))
    return test


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


def test_a_watch_reads_the_pads_whenever_it_is_asked() -> None:
    clock = Clock()
    gripper = FakeGripper(clock, gap=0.020)
    watch = GripWatch(gripper, 0.020)
    told = []
    for tick in range(12):
        clock.t = 0.05 * tick
        gripper.gap = 0.020 if tick < 5 else 0.0
        told.append(watch.evidence().detected)
    assert told == [False] * 7 + [True] * 5  # the third of five readings decides
