"""A camera's intrinsics from pictures of a checkerboard (Hwang 2024, section 3.2.1)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.frame import Intrinsics

FloatArray = NDArray[np.float64]
Channel = TypeVar("Channel", np.uint8, np.float32)

# Corners from a stretched picture are less exact, and of our renders a third fail with it; a dull picture may need it.
HARDER = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE
# Choice: a lens of today is centred, and freed of these the principal point went 1 to 3 pixels astray, not 0.1.
FLAGS = cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K3


@dataclass(frozen=True, eq=False)
class Calibration:
    """What a camera's pictures of a checkerboard tell of it.

    `distortion`: OpenCV's k1, k2, p1, p2, k3, of which the last three are taken to be 0; `rms`: of the corners'
    distances from where they should be, pixels; `residuals`: those of each view (n, 2), seen less expected;
    `deviations`: of fx, fy, cx, cy, pixels.
    """

    intrinsics: Intrinsics
    distortion: tuple[float, float, float, float, float]
    rms: float
    residuals: tuple[FloatArray, ...]
    deviations: tuple[float, float, float, float]


def find_board(rgb: NDArray[np.uint8], columns: int, rows: int) -> FloatArray | None:
    """Pixels (n, 2) of the `columns` x `rows` inner corners of a checkerboard, row by row; None if not all are seen."""
    gray = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    for flags in (cv2.CALIB_CB_ACCURACY, cv2.CALIB_CB_ACCURACY | HARDER):
        found, corners = cv2.findChessboardCornersSB(gray, (columns, rows), flags=flags)
        if found:
            return np.asarray(corners, np.float64).reshape(-1, 2)
    return None


def calibrate(
    views: Sequence[FloatArray], width: int, height: int, columns: int, rows: int, square: float
) -> Calibration:
    """The camera of pictures `width` x `height` with the corners `views`, each (n, 2) as `find_board` gives them.

    `square` is the width of the board's squares in metres. Raises ValueError for fewer than three views.
    """
    if len(views) < 3:
        raise ValueError(f"{len(views)} views of the board; a calibration needs three")
    down, across = np.indices((rows, columns)).reshape(2, -1)
    board = square * np.column_stack([across, down, np.zeros(rows * columns)]).astype(np.float32)
    seen = [view.astype(np.float32) for view in views]
    rms, matrix, distortion, turns, places, deviations, _, _ = cv2.calibrateCameraExtended(
        [board] * len(seen), seen, (width, height), np.eye(3), np.zeros(5), flags=FLAGS
    )
    expected = [
        cv2.projectPoints(board, turn, place, matrix, distortion)[0].reshape(-1, 2)
        for turn, place in zip(turns, places, strict=True)
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

    `image` is colour (H, W, 3) uint8, or depth (H, W) float32 metres, whose readings are moved and never mixed.
    """
    k = intrinsics
    matrix = np.array([[k.fx, 0.0, k.cx], [0.0, k.fy, k.cy], [0.0, 0.0, 1.0]])
    size = (k.width, k.height)
    u, v = cv2.initUndistortRectifyMap(matrix, np.array(distortion), None, matrix, size, cv2.CV_32FC1)
    return np.asarray(cv2.remap(image, u, v, cv2.INTER_LINEAR if image.ndim == 3 else cv2.INTER_NEAREST), image.dtype)
