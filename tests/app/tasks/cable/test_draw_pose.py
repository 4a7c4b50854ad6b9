"""The picture of a result, wherever the pose is."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import RigidTransform

from regrasp.app.tasks.cable.draw import draw_pose
from regrasp.interfaces.cell import pose_along
from regrasp.interfaces.frame import Intrinsics
from regrasp.perception.pose.estimate import Estimate, pose_covariance

HERE = RigidTransform.identity()


def estimate(x: float, y: float, z: float, sign_seen: bool = True) -> Estimate:
    axis = np.array([1.0, 0.0, 0.0])
    pose = pose_along((x, y, z), (1.0, 0.0, 0.0))
    covariance = pose_covariance(axis, 0.002, 0.02)
    return Estimate(0.0, "camera", pose.translation, axis, pose, covariance, 500, 600, 0.09, True, sign_seen)


def test_outline_and_arrow_lie_where_the_connector_projects() -> None:
    k = Intrinsics(848, 480, 600.0, 600.0, 423.5, 239.5)
    drawn = draw_pose(np.zeros((480, 848, 3), np.uint8), k, (estimate(0.0, 0.0, 0.6), HERE), 0.01, 0.09, [])
    v, u = np.nonzero(drawn[:480].any(axis=2))
    assert abs(u.min() - (423.5 - 45)) < 4  # 1,000 pixels a metre, and the nearest edge a little more
    assert abs(u.max() - (423.5 + 45)) < 4
    assert abs(v.min() - (239.5 - 10)) < 4
    assert abs(v.max() - (239.5 + 10)) < 4


def test_an_end_that_is_not_told_apart_has_an_arrow_of_two_heads() -> None:
    k = Intrinsics(848, 480, 600.0, 600.0, 423.5, 239.5)
    black = np.zeros((480, 848, 3), np.uint8)
    one, both = (draw_pose(black, k, (estimate(0.0, 0.0, 0.6, told), HERE), 0.0, 0.09, []) for told in (True, False))
    for drawn, symmetric in ((one, False), (both, True)):
        left, right = np.count_nonzero(drawn[:480, :424]), np.count_nonzero(drawn[:480, 424:])
        assert (abs(left - right) < 0.1 * right) == symmetric


def test_words_hide_nothing_of_a_small_picture_that_is_enlarged() -> None:
    rgb = np.full((12, 16, 3), 77, np.uint8)
    drawn = draw_pose(rgb, Intrinsics(16, 12, 15.0, 15.0, 7.5, 5.5), None, 0.01, 0.09, ["a few words " * 20, "more"])
    assert drawn.shape[1] == 640
    assert (drawn[:480] == 77).all()
    assert drawn.shape[0] > 520


@settings(max_examples=50)
@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(-1, 3))
def test_a_pose_out_of_view_is_not_drawn_and_no_error(x: float, y: float, z: float) -> None:
    k = Intrinsics(64, 48, 60.0, 60.0, 31.5, 23.5)
    drawn = draw_pose(np.zeros((48, 64, 3), np.uint8), k, (estimate(x, y, z), HERE), 0.01, 0.09, [])
    if z < -0.02 or abs(x) > 2 * abs(z) + 0.5:
        assert not drawn[:480].any()
