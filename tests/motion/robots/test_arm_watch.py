import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from robots import VX300S

from regrasp.interfaces.reading import JointReading
from regrasp.interfaces.trajectory import Trajectory
from regrasp.motion.robots.arm_watch import ArmWatch, ArmWatchParameters, remaining_waypoints

DT = 0.05
LIMITS = ArmWatchParameters()


def reading(stamp: float, elbow: float, speed: float = 0.0) -> JointReading:
    unit = np.eye(6)[2]
    return JointReading(stamp, elbow * unit, speed * unit, np.zeros(6))


def turn(seconds: float, angle: float) -> Trajectory:
    goal = angle * np.eye(6)[2]
    return Trajectory(np.array([0.0, seconds]), np.array([np.zeros(6), goal]), np.tile(goal / seconds, (2, 1)))


@pytest.mark.parametrize(("off", "said"), [(0.9 * LIMITS.tracking_error, False), (-1.1 * LIMITS.tracking_error, True)])
def test_an_arm_off_its_trajectory_is_said_with_joint_and_numbers(off: float, said: bool) -> None:
    sentence = ArmWatch("right", VX300S.chain).off_trajectory(reading(1.0, 0.5 + off), turn(2.0, 1.0), 1.0)
    assert bool(sentence) == said
    assert not said or (sentence and "right arm's elbow reads 0.088 rad off its trajectory" in sentence)


def test_a_reading_that_jumps_further_than_the_joint_turned_is_said() -> None:
    watch = ArmWatch("left", VX300S.chain)
    assert watch.jumped(reading(0.0, 0.0, 1.0)) is None
    assert watch.jumped(reading(DT, DT * 1.0, 1.0)) is None
    sentence = watch.jumped(reading(2 * DT, 2 * DT + LIMITS.jump + 0.01, 1.0))
    assert sentence is not None
    assert "elbow" in sentence


def test_readings_far_apart_in_time_say_nothing() -> None:
    watch = ArmWatch("left", VX300S.chain)
    watch.jumped(reading(0.0, 0.0))
    assert watch.jumped(reading(1.0, 2.0)) is None


def test_an_arm_that_moved_while_nobody_led_it_is_said() -> None:
    watch = ArmWatch("left", VX300S.chain)
    assert watch.moved_alone(reading(0.0, 2.0)) is None  # nobody knows where it was left
    watch.leave(reading(0.0, 0.3).positions)
    assert watch.moved_alone(reading(5.0, 0.3 + 0.9 * LIMITS.resting_drift)) is None
    assert watch.moved_alone(reading(5.0, 0.3 + 1.1 * LIMITS.resting_drift)) is not None


@given(
    st.lists(st.lists(st.floats(-3, 3), min_size=6, max_size=6), min_size=2, max_size=6, unique_by=tuple),
    st.integers(0, 4),
    st.floats(0.05, 0.95),
)
def test_the_rest_of_a_path_begins_after_the_place_reached(points: list[list[float]], leg: int, share: float) -> None:
    path: NDArray[np.float64] = np.array(points)
    leg = leg % (len(path) - 1)
    reached = path[leg] + share * (path[leg + 1] - path[leg])
    rest = remaining_waypoints(path, reached)
    assert 1 <= len(rest) <= len(path)
    assert np.array_equal(rest, path[-len(rest) :])
    assert np.array_equal(rest[-1], path[-1])
