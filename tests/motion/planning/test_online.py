"""Online trajectories: they come to their goal at rest, within the limits, and go along with one that drifts."""

from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.motion.planning.online import OnlineParameters, OnlinePlanner

TICK = 0.05
VALUES = OnlineParameters()
places = st.tuples(*[st.floats(-0.5, 0.5)] * 3)
turns = st.tuples(*[st.floats(-0.3, 0.3)] * 3)


def pose(place: Any, turn: Any = (0.0, 0.0, 0.0)) -> FloatArray:
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = Rotation.from_rotvec(turn).as_matrix(), place
    return made


def driven(planner: OnlinePlanner, goals: Any, ticks: int, drift: Any = (0.0, 0.0, 0.0)) -> FloatArray:
    """The tool's poses (ticks, 4, 4), planned anew with every tick."""
    out = []
    for n in range(ticks):
        samples = planner.replan(goals(n), np.array(drift))
        out.append(samples.poses[0])
        planner.advance(TICK)
    return np.array(out)


@settings(max_examples=30, deadline=None)
@given(places, turns)
@example((0.0, 0.0, 0.0), (0.0, 0.25, 0.2109375))  # axes that cannot be timed together, by Ruckig's arithmetic
def test_it_comes_to_rest_at_its_goal_within_the_limits(place: Any, turn: Any) -> None:
    goal = pose(place, turn)
    way = driven(OnlinePlanner(np.eye(4)), lambda n: goal, 160)
    assert way[-1] == pytest.approx(goal, abs=1e-6)
    speeds = np.abs(np.diff(way[:, :3, 3], axis=0)) / TICK
    assert speeds.max() <= VALUES.speed * (1 + 1e-6)
    assert np.abs(np.diff(speeds, axis=0)).max() / TICK <= VALUES.acceleration * (1 + 1e-6)


def test_a_plan_that_is_not_renewed_ends_at_rest_at_the_goal() -> None:
    samples = OnlinePlanner(np.eye(4)).replan(pose((0.3, 0.1, 0.0)), np.zeros(3))
    assert samples.poses[-1][:3, 3] == pytest.approx([0.3, 0.1, 0.0], abs=1e-6)
    assert np.diff(samples.times).min() > 0.02  # shorter steps would magnify rounding errors into speeds


def test_it_goes_along_with_a_goal_that_drifts() -> None:
    drift = np.array([0.0, 0.012, 0.016])
    way = driven(OnlinePlanner(np.eye(4)), lambda n: pose([0.2, 0.0, 0.0] + n * TICK * drift), 80, drift)
    end = [0.2, 0.0, 0.0] + 79 * TICK * drift
    assert way[-1][:3, 3] == pytest.approx(end, abs=1e-6)


def test_a_goal_that_jumps_makes_no_jump_of_the_tool() -> None:
    way = driven(OnlinePlanner(np.eye(4)), lambda n: pose((0.2, 0.05 * (n > 12), 0.0)), 80)
    assert np.abs(np.diff(way[:, :3, 3], axis=0)).max() <= VALUES.speed * TICK * (1 + 1e-6)
    assert way[-1][:3, 3] == pytest.approx([0.2, 0.05, 0.0], abs=1e-6)
