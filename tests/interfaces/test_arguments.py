import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from regrasp.interfaces.arguments import finite, rows, share, vector


@given(arrays(float, st.tuples(st.integers(0, 5), st.just(3)), elements=st.floats(-1e6, 1e6)))
def test_rows_come_through_as_they_are(points: np.ndarray) -> None:
    assert np.array_equal(rows("the points", points, 3), points)
    if len(points):
        assert np.array_equal(rows("the points", points[0], 3), points[:1])
    assert rows("the points", points.tolist(), 3).shape == points.shape


@given(arrays(float, 7, elements=st.floats()))
def test_only_finite_numbers_pass(values: np.ndarray) -> None:
    bad = int((~np.isfinite(values)).sum())
    if bad:
        with pytest.raises(ValueError, match=f"it: {bad} of 7 numbers are not finite"):
            finite("it", values)
    else:
        assert np.array_equal(finite("it", values), values)


@pytest.mark.parametrize("values", [np.zeros((2, 2, 3)), np.zeros(4), np.zeros((2, 4))])
def test_other_shapes_do_not(values: np.ndarray) -> None:
    with pytest.raises(ValueError, match="it have the shape"):
        rows("it", values, 3)
    with pytest.raises(ValueError, match="it has the shape"):
        vector("it", values)


@pytest.mark.parametrize("value", [0.0, -1.0, 1.001, np.nan, np.inf])
def test_a_share_is_above_0_and_at_most_1(value: float) -> None:
    with pytest.raises(ValueError, match="give a number above 0 and at most 1"):
        share("the speed", value)
    assert share("the speed", 1.0) == 1.0
