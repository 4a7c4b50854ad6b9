import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from regrasp.interfaces.trajectory import Trajectory

EXACT = 1e-9  # rad, rad/s
TIMES = np.array([0.0, 0.3, 1.0, 1.4])
COEFFICIENTS = np.array([[0.1, -0.2, 0.5, 0.0, 1.0, -1.0], [1.0, 2.0, -1.0, 0.5, 0.0, 0.3], [0.4] * 6, [-0.7] * 6])


def cubic(t: float) -> NDArray[np.float64]:
    return np.asarray([1.0, t, t**2, t**3] @ COEFFICIENTS)


def cubic_rate(t: float) -> NDArray[np.float64]:
    return np.asarray([0.0, 1.0, 2 * t, 3 * t**2] @ COEFFICIENTS)


@pytest.fixture(scope="module")
def trajectory() -> Trajectory:
    return Trajectory(TIMES, np.array([cubic(t) for t in TIMES]), np.array([cubic_rate(t) for t in TIMES]))


@given(t=st.floats(0.0, 1.4))
def test_a_cubic_is_met_exactly_between_its_samples(trajectory: Trajectory, t: float) -> None:
    position, velocity = trajectory.sample(t)
    np.testing.assert_allclose(position, cubic(t), atol=EXACT)
    np.testing.assert_allclose(velocity, cubic_rate(t), atol=EXACT)


@pytest.mark.parametrize(("t", "end"), [(-1.0, 0), (0.0, 0), (1.4, -1), (9.0, -1)])
def test_the_ends_hold_their_samples(trajectory: Trajectory, t: float, end: int) -> None:
    position, velocity = trajectory.sample(t)
    np.testing.assert_array_equal(position, trajectory.positions[end])
    np.testing.assert_array_equal(velocity, trajectory.velocities[end])


def test_a_single_sample_stands_still() -> None:
    still = Trajectory(np.zeros(1), np.ones((1, 6)), np.zeros((1, 6)))
    assert still.duration == 0.0
    np.testing.assert_array_equal(still.sample(0.5)[0], np.ones(6))


def test_duration(trajectory: Trajectory) -> None:
    assert trajectory.duration == 1.4
