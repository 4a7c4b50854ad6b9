"""Reads a user's colour and depth images into arrays, and writes pictures."""

import os
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from regrasp.app.files.findings import Finding, Findings, shown, why_no_file
from regrasp.app.files.whole_file import write_whole
from regrasp.interfaces.quote import quoted


def read_rgb(path: Path) -> NDArray[np.uint8]:
    """A colour image (H, W, 3) RGB, not rotated by its EXIF orientation. Raises `Findings`."""
    image = _decoded(path, cv2.IMREAD_COLOR_RGB | cv2.IMREAD_IGNORE_ORIENTATION)
    if image is None:
        raise _wrong(path, "is no image that can be read; take it out or save it again")
    return np.asarray(image, np.uint8)


def read_depth(path: Path, unit: float, min_median: float = 0.05, max_median: float = 20.0) -> NDArray[np.float32]:
    """Depth (H, W) in metres, 0 where there is no reading.

    Integers count `unit` metres, as in a 16-bit PNG; floats are metres, as in a .npy file. 8-bit integers are refused:
    they are a picture of depth. A median outside `min_median` to `max_median` m means another unit.

    Raises:
        Findings: no file, no depth image, or depth in another unit.
    """
    image = _array(path) if path.suffix.lower() == ".npy" else _decoded(path, cv2.IMREAD_UNCHANGED)
    if image is None:
        raise _wrong(path, "is no depth image that can be read; give a 16-bit PNG, or a .npy array of metres")
    if image.ndim != 2 or not (image.dtype.kind == "f" or (image.dtype.kind in "iu" and image.dtype.itemsize > 1)):
        shape = " x ".join(map(str, image.shape))
        right = "depth is H x W, whole numbers of 16 bits or more, or floats in metres"
        raise _wrong(path, f"is {shape} of type {image.dtype}; {right}")
    with np.errstate(all="ignore"):  # an overflow is no reading
        depth = np.asarray(image, np.float32) * np.float32(1.0 if image.dtype.kind == "f" else unit)
    depth[~(np.isfinite(depth) & (depth > 0.0))] = 0.0
    readings = depth[depth > 0.0]
    middle = float(np.median(readings)) if len(readings) else 1.0
    if not min_median <= middle <= max_median:
        right = "give floats in metres, or whole numbers and their --depth-unit"
        raise _wrong(
            path, f"its middle reading is {middle:.3g} m, expected {min_median} to {max_median:.0f} m; {right}"
        )
    return depth


def write_picture(path: Path, rgb: NDArray[np.uint8]) -> None:
    """Write a colour image (H, W, 3) RGB as PNG or JPEG, by the file's suffix; its folder is made if need be."""
    ok, data = cv2.imencode(path.suffix, cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR))
    assert ok
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, data.tobytes())


def _decoded(path: Path, flags: int) -> NDArray[np.generic] | None:
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)  # our findings say what is wrong
    _check_file(path)
    data = np.fromfile(path, np.uint8)
    try:
        return cv2.imdecode(data, flags) if len(data) else None
    except cv2.error:  # more pixels than it allows
        return None


def _array(path: Path) -> NDArray[np.generic] | None:
    _check_file(path)
    try:
        found = np.load(
            path, mmap_mode="r", allow_pickle=False
        )  # mapped: the header may state more than the file holds
    except Exception:  # numpy raises errors of many types for a broken header
        return None
    return found if isinstance(found, np.ndarray) else None


def _check_file(path: Path) -> None:
    if not os.path.isfile(path):  # False, too, in a folder that may not be read
        raise Findings([Finding(shown(path), 0, f"{quoted(shown(path))} {why_no_file(path)}; name an image file")])


def _wrong(path: Path, message: str) -> Findings:
    return Findings([Finding(shown(path), 0, message)])
