from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.trajectory import Trajectory
from regrasp.motion.planning.timing import JointLimits, PathSpeed, TimingParameters, time_path

ACCELERATION = 5.0  # rad/s2 of every joint
LIMITS = JointLimits(np.full(6, np.pi), np.full(6, ACCELERATION))
STOP_TIME = TimingParameters().stop_time
LEVERS = np.array([0.7, 0.7, 0.4, 0.2, 0.2, 0.1])  # m that the far end moves by a rad
paths = st.integers(2, 6).flatmap(lambda k: arrays(float, (k, 6), elements=st.floats(-2, 2, width=32)))


def finely(trajectory: Trajectory) -> tuple[FloatArray, FloatArray]:
    samples = [trajectory.sample(t) for t in np.arange(0.0, trajectory.duration, 0.002)]
    return np.array([p for p, _ in samples]), np.array([v for _, v in samples])


def distance_to_path(point: FloatArray, path: FloatArray) -> float:
    best = np.inf
    for a, b in pairwise(path):
        s = np.clip((point - a) @ (b - a) / max((b - a) @ (b - a), 1e-12), 0, 1)
        best = min(best, float(np.linalg.norm(a + s * (b - a) - point)))
    return best


def test_a_smooth_line_of_many_waypoints_along_which_the_solver_fails() -> None:
    """Found in the habitat: toppra fails with all 62 waypoints of this line, and not with half of them."""
    path = np.load(Path(__file__).with_name("line_of_62_waypoints.npy"))
    limits = JointLimits(
        np.array([0.5, 3.14, 3.14, 3.14, 3.14, 3.14, 3.14]), np.array([1.0, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0])
    )
    with pytest.raises(RuntimeError, match="no timing"):
        time_path(path, limits, 0.3, TimingParameters(thinned=(1,)))
    trajectory = time_path(path, limits, 0.3)
    assert trajectory.positions[-1] == pytest.approx(path[-1], abs=1e-6)
    assert all(distance_to_path(q, path) < 2e-3 for q in trajectory.positions[::5])


@settings(max_examples=40, deadline=None)
@given(paths)
def test_within_limits_at_rest_at_the_ends_and_near_the_path(path: FloatArray) -> None:
    trajectory = time_path(path, LIMITS)
    assert trajectory.positions[0] == pytest.approx(path[0], abs=1e-6)
    assert trajectory.positions[-1] == pytest.approx(path[-1], abs=1e-6)
    assert not trajectory.velocities[[0, -1]].any()
    assert np.all(np.diff(trajectory.times) > 0)
    assert np.all(np.diff(trajectory.times) <= 0.02)
    positions, velocities = finely(trajectory)
    if len(positions) > 2:
        acceleration = np.abs(np.diff(velocities, axis=0)) / 0.002
        assert np.all(acceleration < ACCELERATION * 1.01)
        assert np.all(np.abs(velocities) <= ACCELERATION * STOP_TIME * 1.01)
    assert max((distance_to_path(p, path) for p in positions[::10]), default=0.0) < 0.06


@settings(max_examples=40, deadline=None)
@given(st.sampled_from([6, 7, 8]), st.integers(2, 6), st.integers(0, 2**32 - 1))
def test_every_joint_keeps_limits_of_its_own(joints: int, waypoints: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    speeds, accelerations = rng.uniform(0.3, 4.0, joints), rng.uniform(1.0, 20.0, joints)
    trajectory = time_path(rng.uniform(-2, 2, (waypoints, joints)), JointLimits(speeds, accelerations))
    _, velocities = finely(trajectory)
    assert np.all(np.abs(velocities) <= speeds * 1.01)
    assert np.all(np.abs(velocities) <= accelerations * STOP_TIME * 1.01)
    assert np.all(np.abs(np.diff(velocities, axis=0)) / 0.002 <= accelerations * 1.01)


def test_one_row_is_a_trajectory_that_stays() -> None:
    q = np.arange(6.0)
    trajectory = time_path(q[None], LIMITS)
    assert trajectory.duration == 0.0
    assert trajectory.sample(0.5)[0] == pytest.approx(q)


def test_a_way_back_that_begins_all_but_at_rest_has_a_timing() -> None:
    rng = np.random.default_rng(0)
    for _ in range(600):  # toppra found none for one in 200
        steps = np.append(rng.uniform(1e-4, 1e-3, 8), 10 ** rng.uniform(-9, -7.3))
        path = np.cumsum(np.vstack([np.zeros(6), steps[:, None] * rng.normal(0, 1, (9, 6))]), axis=0)
        trajectory = time_path(path, LIMITS, 0.3)
        assert trajectory.positions[[0, -1]] == pytest.approx(path[[0, -1]], abs=1e-6)


def test_half_the_speed_takes_twice_as_long() -> None:
    path = np.array([np.zeros(6), np.ones(6), [1, 1, 1, 0, 0, 0.0]])
    assert time_path(path, LIMITS, speed=0.5).duration == pytest.approx(2 * time_path(path, LIMITS).duration, rel=0.05)


def at_most(speed: Callable[[FloatArray], FloatArray]) -> PathSpeed:
    """Lets all joints move the far end together by no more than `speed` (k,) m/s, by the joints (k, 6)."""

    def allowed(path: FloatArray, slopes: FloatArray) -> FloatArray:
        return np.asarray(speed(path) / np.maximum(np.abs(slopes) @ LEVERS, 1e-9))

    return allowed


@settings(max_examples=40, deadline=None)
@given(paths, st.sampled_from([1.0, 0.7, 0.3]), st.integers(0, 2**32 - 1))
def test_a_speed_that_changes_along_the_path_is_kept_at_every_moment(path: FloatArray, speed: float, seed: int) -> None:
    across = np.random.default_rng(seed).uniform(-1, 1, 6)

    def least(q: FloatArray) -> FloatArray:
        return np.asarray(0.25 + 0.15 * np.sin(q @ across))

    trajectory = time_path(path, LIMITS, speed, allowed=at_most(least))
    positions, velocities = finely(trajectory)
    if len(positions) > 2:
        assert np.all(np.abs(velocities) @ LEVERS <= 1.02 * least(positions))
        assert np.all(np.abs(np.diff(velocities, axis=0)) / 0.002 < ACCELERATION * 1.01)
    assert not trajectory.velocities[[0, -1]].any()
    assert max((distance_to_path(p, path) for p in positions[::10]), default=0.0) < 0.06


@settings(max_examples=20, deadline=None)
@given(paths)
def test_a_speed_that_is_free_everywhere_changes_nothing(path: FloatArray) -> None:
    def anywhere(q: FloatArray) -> FloatArray:
        return np.full(len(q), np.inf)

    plain, free = (time_path(path, LIMITS, 0.7, allowed=allowed) for allowed in (None, at_most(anywhere)))
    assert np.array_equal(plain.times, free.times)
    assert np.array_equal(plain.positions, free.positions)
    assert np.array_equal(plain.velocities, free.velocities)


@pytest.mark.parametrize("speed", [1.0, 0.5])
def test_only_the_half_of_a_path_with_a_limit_is_slow(speed: float) -> None:
    path = np.outer([-1.0, 1.0], np.eye(6)[0])

    def second_half(q: FloatArray) -> FloatArray:
        return np.where(q[:, 0] > 0.0, 0.20, np.inf)

    trajectory = time_path(path, LIMITS, speed, allowed=at_most(second_half))
    positions, velocities = finely(trajectory)
    fast = velocities[positions[:, 0] < -0.5, 0].max()
    assert fast == pytest.approx(finely(time_path(path, LIMITS, speed))[1].max(), rel=0.02)
    slow = LEVERS[0] * velocities[positions[:, 0] > 0.0, 0]
    assert slow.max() == pytest.approx(0.20, rel=0.02)
