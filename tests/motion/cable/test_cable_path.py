from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from natural import natural_pose, natural_ways
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cable.cell import CableKnown

sideways = st.tuples(st.floats(-0.15, 0.15), st.floats(-0.15, 0.2)).map(lambda xz: np.array([xz[0], 0.0, xz[1]]))
turns = st.tuples(*[st.floats(-0.2, 0.2)] * 3)
shifts = st.tuples(*[st.floats(-0.02, 0.02)] * 3)


def cable_end(known: CableKnown, connector: RigidTransform) -> np.ndarray:
    return np.asarray(connector.apply([-0.5 * known.cable.connector.length, 0.0, 0.0]))


def test_an_unbent_cable_runs_straight_from_its_socket(known: CableKnown) -> None:
    anchor, course = known.cable.anchor
    pose = natural_pose(known, np.zeros(3))
    assert pose.rotation.apply([1.0, 0.0, 0.0]) == pytest.approx(course)
    assert cable_end(known, pose) == pytest.approx(anchor + known.cable.length * course)


@given(sideways)
def test_a_bent_cable_keeps_its_length_and_points_along_its_end(known: CableKnown, off: np.ndarray) -> None:
    anchor, course = known.cable.anchor
    pose = natural_pose(known, off)
    end = cable_end(known, pose) - anchor
    assert end - (end @ course) * course == pytest.approx(off, abs=1e-9)
    s = np.linspace(0.0, 1.0, 400)[:, None]  # a cantilever under a load at its end: d (3 s^2 - s^3) / 2
    shape = s * (end @ course) * course + 0.5 * (3 * s**2 - s**3) * off
    steps = np.diff(shape, axis=0)
    assert np.linalg.norm(steps, axis=1).sum() == pytest.approx(known.cable.length, rel=0.02)
    assert pose.rotation.apply([1.0, 0.0, 0.0]) @ steps[-1] / np.linalg.norm(steps[-1]) > 0.9999


@given(sideways, sideways, shifts, turns)
def test_every_way_ends_at_the_goal_in_small_steps(
    known: CableKnown, begin: np.ndarray, end: np.ndarray, shift: tuple[float, ...], turn: tuple[float, ...]
) -> None:
    off = RigidTransform.from_components(shift, Rotation.from_rotvec(turn))
    start, goal = natural_pose(known, begin) * off, natural_pose(known, end) * off
    ways = list(natural_ways(known, start, goal))
    assert len(ways) > 1
    for way in ways:
        assert way[-1].translation == pytest.approx(goal.translation, abs=1e-6)
        assert (way[-1].rotation.inv() * goal.rotation).magnitude() < 1e-6
        poses = [start, *way]
        steps = [np.linalg.norm(b.translation - a.translation) for a, b in pairwise(poses)]
        assert max(steps) < 0.06


@given(sideways, sideways)
def test_between_natural_shapes_the_direct_way_is_natural(
    known: CableKnown, begin: np.ndarray, end: np.ndarray
) -> None:
    anchor, course = known.cable.anchor
    direct = next(iter(natural_ways(known, natural_pose(known, begin), natural_pose(known, end))))
    for pose in direct:
        place = cable_end(known, pose) - anchor
        expected = natural_pose(known, place - (place @ course) * course)
        assert pose.translation == pytest.approx(expected.translation, abs=1e-6)
        assert (pose.rotation.inv() * expected.rotation).magnitude() < 1e-4
