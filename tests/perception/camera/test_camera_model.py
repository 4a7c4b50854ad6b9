import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from regrasp.interfaces.frame import Intrinsics
from regrasp.perception.camera.model import deproject, pixel_rays, project, subsampled

CAMERA = Intrinsics.from_fov(848, 480, np.deg2rad(65.0))


@given(st.integers(0, 847), st.integers(0, 479), st.floats(0.1, 3.0))
def test_a_deprojected_pixel_projects_onto_itself(u: int, v: int, z: float) -> None:
    depth = np.zeros((480, 848), np.float32)
    depth[v, u] = z
    point = deproject(depth, depth > 0, CAMERA)
    assert point[0, 2] == pytest.approx(z, rel=1e-6)
    assert deproject(depth, np.ones((1, 1), np.bool_), CAMERA, (u, v)) == pytest.approx(point)
    assert project(point, CAMERA)[0] == pytest.approx([u, v], abs=1e-3)


def test_axes_are_right_down_forward() -> None:
    assert pixel_rays(CAMERA)[0, 0, 0] < 0 < pixel_rays(CAMERA)[0, -1, 0]
    assert pixel_rays(CAMERA)[0, 0, 1] < 0 < pixel_rays(CAMERA)[-1, 0, 1]
    half_width = pixel_rays(CAMERA)[0, -1, 0] + 0.5 / CAMERA.fx
    assert half_width == pytest.approx(np.tan(np.deg2rad(32.5)), rel=1e-5)


def test_missing_readings_give_no_points() -> None:
    depth = np.array([[0.0, np.nan, np.inf, -1.0, 2.0]], np.float32)
    points = deproject(depth, np.ones((1, 5), np.bool_), Intrinsics(5, 1, 1.0, 1.0, 2.0, 0.0))
    assert points.tolist() == [[4.0, 0.0, 2.0]]


def test_a_subsampled_camera_has_every_fourth_ray() -> None:
    np.testing.assert_allclose(pixel_rays(subsampled(CAMERA, 4)), pixel_rays(CAMERA)[::4, ::4], atol=1e-6)
