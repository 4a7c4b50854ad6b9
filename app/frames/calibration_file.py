"""Calibration files: a camera's intrinsics as `regrasp calibrate` measured them."""

from pathlib import Path
from typing import Annotated

import yaml
from pydantic import Field

from regrasp.app.files.findings import shown
from regrasp.app.files.resources import read_text
from regrasp.app.files.validation import validated
from regrasp.app.files.whole_file import write_whole
from regrasp.app.files.yaml_lines import parse
from regrasp.interfaces.fields import Model, NotNegative, Number, Positive
from regrasp.interfaces.frame import Intrinsics

Pixels = Annotated[int, Field(ge=16, le=16384)]

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")


class CalibrationFile(Model):
    """A pinhole camera; lengths in pixels, pixel (0, 0) is the centre of the top left pixel."""

    width: Pixels
    height: Pixels
    fx: Positive
    fy: Positive
    cx: Number
    cy: Number
    distortion: tuple[Number, Number, Number, Number, Number] = (0.0, 0.0, 0.0, 0.0, 0.0)  # OpenCV's k1, k2, p1, p2, k3
    rms: NotNegative | None = None  # px, of the corners' residuals

    @property
    def intrinsics(self) -> Intrinsics:
        """The camera without its distortion, for pictures to which `undistorted` was applied."""
        return Intrinsics(self.width, self.height, self.fx, self.fy, self.cx, self.cy)


def load_calibration(path: Path) -> CalibrationFile:
    """Read a calibration file. Raises `Findings` with everything that is wrong in it."""
    return validated(parse(read_text(path), shown(path)), CalibrationFile)


def write_calibration(path: Path, calibration: CalibrationFile) -> None:
    """Write it as YAML. Raises OSError."""
    write_whole(
        path,
        yaml.safe_dump(
            calibration.model_dump(mode="json", exclude_none=True), sort_keys=False, default_flow_style=None
        ),
    )
