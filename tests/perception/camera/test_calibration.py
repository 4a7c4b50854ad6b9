"""Calibration from rendered boards, and from corners whose camera has a known lens."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from regrasp.interfaces.frame import Intrinsics
from regrasp.perception.camera.calibration import calibrate_intrinsics, find_checkerboard, undistorted
from regrasp.sim.cameras.board import board_pictures, board_poses

K = Intrinsics.from_fov(848, 480, float(np.deg2rad(65.0)))
COLUMNS, ROWS, SQUARE = 9, 6, 0.025


def matrix(k: Intrinsics) -> NDArray[np.float64]:
    return np.array([[k.fx, 0.0, k.cx], [0.0, k.fy, k.cy], [0.0, 0.0, 1.0]])


def corners_through(lens: list[float], noise: float, seed: int, views: int = 15) -> list[NDArray[np.float64]]:
    """The corners of random views through a lens with these distortion coefficients."""
    rng = np.random.default_rng(seed)
    down, across = np.indices((ROWS, COLUMNS)).reshape(2, -1)
    board = SQUARE * np.column_stack([across - 4.0, 2.5 - down, np.zeros(ROWS * COLUMNS)])
    poses = board_poses(K, COLUMNS, ROWS, SQUARE, views, rng)
    seen = [
        cv2.projectPoints(board, p.rotation.as_rotvec(), p.translation, matrix(K), np.array(lens))[0] for p in poses
    ]
    return [s.reshape(-1, 2) + rng.normal(0.0, noise, (ROWS * COLUMNS, 2)) for s in seen]


def test_rendered_boards_give_the_camera_that_took_them() -> None:
    poses = board_poses(K, COLUMNS, ROWS, SQUARE, 12, np.random.default_rng(5))
    views = [find_checkerboard(rgb, COLUMNS, ROWS) for rgb in board_pictures(K, poses, COLUMNS, ROWS, SQUARE)]
    seen = [view for view in views if view is not None]
    assert len(seen) >= 11
    found = calibrate_intrinsics(seen, K.width, K.height, COLUMNS, ROWS, SQUARE)
    assert found.rms < 0.3
    assert max(float(np.linalg.norm(r, axis=1).mean()) for r in found.residuals) < 0.3
    assert found.intrinsics.fx == pytest.approx(K.fx, rel=0.005)
    assert found.intrinsics.fy == pytest.approx(K.fy, rel=0.005)
    assert (found.intrinsics.cx, found.intrinsics.cy) == pytest.approx((K.cx, K.cy), abs=3.0)
    assert (found.intrinsics.width, found.intrinsics.height) == (K.width, K.height)


@settings(max_examples=15)
@given(st.floats(-0.3, 0.1), st.floats(-0.1, 0.1), st.integers(0, 1000))
def test_a_lens_is_told_apart_from_the_focal_length(k1: float, k2: float, seed: int) -> None:
    found = calibrate_intrinsics(
        corners_through([k1, k2, 0.0, 0.0], 0.05, seed), K.width, K.height, COLUMNS, ROWS, SQUARE
    )
    assert found.rms < 0.15
    assert abs(found.intrinsics.fx - K.fx) < 6 * found.deviations[0] + 0.1
    assert found.distortion[0] == pytest.approx(k1, abs=0.03)


def test_the_deviations_grow_with_the_corners_noise() -> None:
    quiet, noisy = (
        calibrate_intrinsics(corners_through([0.0] * 4, noise, 1), K.width, K.height, COLUMNS, ROWS, SQUARE)
        for noise in (0.05, 0.5)
    )
    assert noisy.deviations[0] > 5 * quiet.deviations[0]


def test_two_views_are_too_few() -> None:
    with pytest.raises(ValueError, match="2 views"):
        calibrate_intrinsics(corners_through([0.0] * 4, 0.0, 1)[:2], K.width, K.height, COLUMNS, ROWS, SQUARE)


def test_no_board_is_found_where_there_is_none() -> None:
    for rgb in (np.zeros((120, 160, 3), np.uint8), np.random.default_rng(0).integers(0, 256, (120, 160, 3), np.uint8)):
        assert find_checkerboard(rgb, COLUMNS, ROWS) is None


def test_a_straight_line_is_straight_again() -> None:
    """A point drawn where the lens puts it comes to where the pinhole sees it; depth readings are not mixed."""
    lens = [-0.25, 0.05, 0.0, 0.0, 0.0]
    points = np.array([[x, y, 1.0] for x in (-0.5, 0.0, 0.4) for y in (-0.25, 0.2)])
    bent = cv2.projectPoints(points, np.zeros(3), np.zeros(3), matrix(K), np.array(lens))[0].reshape(-1, 2)
    straight = points[:, :2] * [K.fx, K.fy] + [K.cx, K.cy]
    rgb, depth = np.zeros((K.height, K.width, 3), np.uint8), np.full((K.height, K.width), 2.0, np.float32)
    for u, v in np.rint(bent).astype(int):
        cv2.circle(rgb, (u, v), 4, (255, 255, 255), -1)
        cv2.circle(depth, (u, v), 4, 0.5, -1)
    mended, readings = undistorted(rgb, K, lens), undistorted(depth, K, lens)
    for u, v in np.rint(straight).astype(int):
        if 0 <= u < K.width and 0 <= v < K.height:
            assert mended[v, u].min() > 200
            assert readings[v, u] == 0.5
    assert set(np.unique(readings)) <= {0.0, 0.5, 2.0}
    same = undistorted(depth, K, [0.0] * 5)
    np.testing.assert_array_equal(same, depth)
