"""The compiled poses against scipy's."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import RigidTransform, Rotation, Slerp

from regrasp.motion.robots.poses import (
    angle_between,
    inverse,
    multiply,
    poses_between,
    rotation_matrix,
    rotation_vector,
)

_part = st.floats(-1.0, 1.0)
turns = st.tuples(_part, _part, _part, st.floats(0.0, np.pi - 1e-6)).map(
    lambda v: v[3] * np.array(v[:3]) / max(float(np.linalg.norm(v[:3])), 1e-3)
)
poses = st.tuples(st.tuples(_part, _part, _part), turns).map(
    lambda both: RigidTransform.from_components(both[0], Rotation.from_rotvec(both[1]))
)


@given(turns)
def test_a_rotation_vector_and_its_matrix_are_scipy_s(vector: np.ndarray) -> None:
    expected = Rotation.from_rotvec(vector).as_matrix()
    np.testing.assert_allclose(rotation_matrix(vector), expected, atol=1e-12)
    # Near half a turn the sign of the axis is undecided; the rotation is not.
    np.testing.assert_allclose(rotation_matrix(rotation_vector(expected)), expected, atol=1e-9)
    assert float(np.linalg.norm(rotation_vector(expected))) <= np.pi + 1e-12


@given(poses, poses)
def test_products_and_inverses_are_scipy_s(a: RigidTransform, b: RigidTransform) -> None:
    np.testing.assert_allclose(multiply(a.as_matrix(), b.as_matrix()), (a * b).as_matrix(), atol=1e-12)
    np.testing.assert_allclose(inverse(a.as_matrix()), a.inv().as_matrix(), atol=1e-12)
    expected = (a.rotation.inv() * b.rotation).magnitude()
    assert abs(angle_between(a.as_matrix(), b.as_matrix()) - expected) < 1e-7


@given(poses, poses, st.floats(0.05, 1.0), st.floats(0.1, 1.0))
def test_poses_between_two_are_even_and_small_steps(
    a: RigidTransform, b: RigidTransform, step: float, turn_step: float
) -> None:
    way = poses_between(a.as_matrix(), b.as_matrix(), step, turn_step)
    np.testing.assert_allclose(way[-1], b.as_matrix(), atol=1e-9)
    shares = np.arange(1, len(way) + 1) / len(way)
    here = np.vstack([a.translation, way[:, :3, 3]])
    np.testing.assert_allclose(
        np.diff(here, axis=0), [(b.translation - a.translation) / len(way)] * len(way), atol=1e-9
    )
    assert float(np.linalg.norm(np.diff(here, axis=0), axis=1).max()) < step + 1e-6
    angle = float((a.rotation.inv() * b.rotation).magnitude())
    assert angle / len(way) < turn_step + 1e-6
    if angle < 3.0:  # beyond, the shorter way round is a matter of rounding
        expected = Slerp([0.0, 1.0], Rotation.concatenate([a.rotation, b.rotation]))(shares).as_matrix()
        np.testing.assert_allclose(way[:, :3, :3], expected, atol=1e-9)
