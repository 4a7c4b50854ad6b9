"""A camera's intrinsics from pictures of a checkerboard (Hwang 2024, section 3.2.1)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.arrays import ColorImage, FloatArray
from regrasp.interfaces.frame import Intrinsics

Channel = TypeVar("Channel", np.uint8, np.float32)

# For a second try on pictures with little contrast. Not for the first: corners from a normalised picture are less
# exact, and a third of our renders fail with it.
_LOW_CONTRAST = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE
# Choice: today's lenses are centred. With these coefficients free the principal point was 1 to 3 pixels off, not 0.1.
_FIXED_COEFFICIENTS = cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K3


@dataclass(frozen=True, eq=False)
class Calibration:
    """What pictures of a checkerboard tell about a camera.

    Attributes:
        intrinsics: focal lengths and principal point, pixels.
        distortion: OpenCV's k1, k2, p1, p2, k3; the last three are fixed at 0.
        rms: root mean square of the corners' reprojection errors, pixels.
        residuals: reprojection errors of each view (n, 2), measured minus expected, pixels.
        deviations: standard deviations of fx, fy, cx, cy, pixels.
    """

    intrinsics: Intrinsics
    distortion: tuple[float, float, float, float, float]
    rms: float
    residuals: tuple[FloatArray, ...]
    deviations: tuple[float, float, float, float]


def find_checkerboard(rgb: ColorImage, columns: int, rows: int) -> FloatArray | None:
    """Pixels (n, 2) of the `columns` x `rows` inner corners of a checkerboard, row by row; None if not all are seen."""
    gray = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    for flags in (cv2.CALIB_CB_ACCURACY, cv2.CALIB_CB_ACCURACY | _LOW_CONTRAST):
        found, corners = cv2.findChessboardCornersSB(gray, (columns, rows), flags=flags)
        if found:
            return np.asarray(corners, np.float64).reshape(-1, 2)
    return None


def calibrate_intrinsics(
    views: Sequence[FloatArray], width: int, height: int, columns: int, rows: int, square: float
) -> Calibration:
    r"""The camera that took pictures of `width` x `height` pixels with the corners `views`, each (n, 2).

    The least squares of the reprojection errors over intrinsics and board poses (Zhang 2000):

    .. math:: \min \sum_{i,j} \lVert u_{ij} - \pi(K, d, R_i, t_i, X_j) \rVert^2

    Args:
        views: corners of each picture as `find_checkerboard` gives them, pixels.
        width: of the pictures, pixels.
        height: of the pictures, pixels.
        columns: inner corners in a row of the board.
        rows: rows of inner corners.
        square: edge of the board's squares, metres.

    Raises:
        ValueError: for fewer than three views.
    """
    if len(views) < 3:
        raise ValueError(f"{len(views)} views of the board; a calibration needs three")
    down, across = np.indices((rows, columns)).reshape(2, -1)
    board = square * np.column_stack([across, down, np.zeros(rows * columns)]).astype(np.float32)
    seen = [view.astype(np.float32) for view in views]
    rms, matrix, distortion, rotations, translations, deviations, _, _ = cv2.calibrateCameraExtended(
        [board] * len(seen), seen, (width, height), np.eye(3), np.zeros(5), flags=_FIXED_COEFFICIENTS
    )
    expected = [
        cv2.projectPoints(board, rotation, translation, matrix, distortion)[0].reshape(-1, 2)
        for rotation, translation in zip(rotations, translations, strict=True)
    ]
    fx, fy, cx, cy = float(matrix[0, 0]), float(matrix[1, 1]), float(matrix[0, 2]), float(matrix[1, 2])
    k1, k2, p1, p2, k3 = distortion.ravel()[:5].tolist()
    return Calibration(
        Intrinsics(width, height, fx, fy, cx, cy),
        (k1, k2, p1, p2, k3),
        float(rms),
        tuple(view - there for view, there in zip(views, expected, strict=True)),
        tuple(deviations.ravel()[:4].tolist()),
    )


def undistorted(image: NDArray[Channel], intrinsics: Intrinsics, distortion: Sequence[float]) -> NDArray[Channel]:
    """The picture that a camera with the same intrinsics and no distortion would take; 0 where the lens saw nothing.

    `image` is colour (H, W, 3) uint8, or depth (H, W) float32 metres. Depth readings are moved, never interpolated.
    """
    k = intrinsics
    matrix = np.array([[k.fx, 0.0, k.cx], [0.0, k.fy, k.cy], [0.0, 0.0, 1.0]])
    size = (k.width, k.height)
    u, v = cv2.initUndistortRectifyMap(matrix, np.array(distortion), None, matrix, size, cv2.CV_32FC1)
    return np.asarray(cv2.remap(image, u, v, cv2.INTER_LINEAR if image.ndim == 3 else cv2.INTER_NEAREST), image.dtype)
