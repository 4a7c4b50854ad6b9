"""A user's own frames: colour, depth and intrinsics in files."""

from pathlib import Path

import numpy as np

from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.frames.calibration_file import CalibrationFile, load_calibration
from regrasp.app.frames.image_files import read_depth, read_rgb
from regrasp.interfaces.frame import RgbdFrame
from regrasp.perception.camera.calibration import undistorted


def read_frame(
    rgb: Path,
    depth: Path | None,
    intrinsics: Path,
    *,
    unit: float = 0.001,
    camera: str = "camera",
    number: int = 0,
    focal_range: tuple[float, float] = (0.2, 20.0),
) -> RgbdFrame:
    """A frame of pictures in files, with the lens distortion taken out; without `depth` no pixel has a reading.

    `unit`: metres that an integer of the depth image counts. `camera`, `number`: the frame's. `focal_range`: plausible
    focal lengths over the picture's width; a fisheye lens has 0.3, a long lens 10.

    Raises:
        Findings: a file cannot be read, or they do not fit together.
    """
    calibration = load_calibration(intrinsics)
    _check(calibration, shown(intrinsics), focal_range)
    k = calibration.intrinsics
    color, readings = read_rgb(rgb), None if depth is None else read_depth(depth, unit)
    of_camera = f"{shown(intrinsics)} is for {k.width}x{k.height}"
    wrong = [
        Finding(shown(path), 0, f"is {image.shape[1]}x{image.shape[0]} pixels, {of_camera}; "
                "give the pictures and the intrinsics of one camera in one mode, depth aligned to colour")
        for path, image in ((rgb, color), (depth, readings))
        if path is not None and image is not None and image.shape[:2] != (k.height, k.width)
    ]  # fmt: skip
    if wrong:
        raise Findings(wrong)
    if readings is None:
        readings = np.zeros((k.height, k.width), np.float32)
    if any(calibration.distortion):
        color = undistorted(color, k, calibration.distortion)
        readings = undistorted(readings, k, calibration.distortion)
    return RgbdFrame(camera, number, 0.0, color, readings, k)


def _check(camera: CalibrationFile, source: str, focal_range: tuple[float, float]) -> None:
    """Raises `Findings` for intrinsics that no camera has."""
    k = camera.intrinsics
    if not all(focal_range[0] <= f / k.width <= focal_range[1] for f in (k.fx, k.fy)):
        right = f"expected {focal_range[0] * k.width:.0f} to {focal_range[1] * k.width:.0f} for pictures {k.width} wide"
        raise Findings([Finding(source, 0, f"fx, fy are {k.fx:g}, {k.fy:g} pixels; {right}")])
    if not (abs(k.cx - k.width / 2) < k.width and abs(k.cy - k.height / 2) < k.height):
        right = f"expected a point near the middle of {k.width}x{k.height} pixels"
        raise Findings([Finding(source, 0, f"cx, cy are {k.cx:g}, {k.cy:g}; {right}")])
    if _folds(camera):
        right = "write OpenCV's k1, k2, p1, p2, k3, or none"
        raise Findings([Finding(source, 0, f"distortion bends the picture beyond use; {right}")])


def _folds(camera: CalibrationFile) -> bool:
    r"""Whether the radial distortion folds the picture, or more than doubles a radius, within its shorter half side.

    .. math:: r_d = r (1 + k_1 r^2 + k_2 r^4 + k_3 r^6)

    It folds where :math:`r_d` no longer grows with r (Brown 1971). Further out it may: a calibration may have seen no
    corner there.
    """
    k, (k1, k2, _, _, k3) = camera.intrinsics, camera.distortion
    r = np.linspace(0.0, 0.5 * min(k.width / k.fx, k.height / k.fy), 100)
    with np.errstate(over="ignore", invalid="ignore"):
        distorted = r * (1.0 + k1 * r**2 + k2 * r**4 + k3 * r**6)
        return not bool(np.all(np.diff(distorted) > 0) and distorted[-1] < 2.0 * r[-1])  # NaN too
