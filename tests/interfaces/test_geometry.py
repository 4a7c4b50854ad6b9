import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from regrasp.interfaces.geometry import rotation_about, skew

_part = st.floats(-1.0, 1.0)
vectors = st.tuples(_part, _part, _part).map(np.array).filter(lambda v: float(np.linalg.norm(v)) > 1e-3)


@given(vectors, vectors)
def test_a_skew_matrix_gives_the_cross_product(v: np.ndarray, w: np.ndarray) -> None:
    np.testing.assert_allclose(skew(v) @ w, np.cross(v, w), atol=1e-12)
    np.testing.assert_array_equal(skew(np.stack([v, w]))[1], skew(w))


@given(vectors, st.floats(-7.0, 7.0))
def test_a_rotation_is_scipy_s(axis: np.ndarray, angle: float) -> None:
    unit = axis / np.linalg.norm(axis)
    np.testing.assert_allclose(rotation_about(unit, angle), Rotation.from_rotvec(angle * unit).as_matrix(), atol=1e-12)
