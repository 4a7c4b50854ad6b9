import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from regrasp.interfaces.frame import Intrinsics


@given(width=st.integers(16, 4096), height=st.integers(16, 4096), fov=st.floats(0.1, 2.9))
def test_the_outer_pixels_edges_span_the_field_of_view(width: int, height: int, fov: float) -> None:
    k = Intrinsics.from_fov(width, height, fov)
    left, right = np.arctan((-0.5 - k.cx) / k.fx), np.arctan((width - 0.5 - k.cx) / k.fx)
    assert right - left == pytest.approx(fov)
    assert left == pytest.approx(-right)
    assert k.fx == k.fy
    assert k.cy == (height - 1) / 2


def test_the_d415() -> None:
    k = Intrinsics.from_fov(848, 480, np.deg2rad(65.0))
    assert k.fx == pytest.approx(665.5, abs=0.1)  # 424 / tan(32.5 degrees)
    assert (k.cx, k.cy) == (423.5, 239.5)
