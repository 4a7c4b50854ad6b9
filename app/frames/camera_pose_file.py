"""Camera pose files: a camera's pose in the world of a cell."""

from pathlib import Path
from typing import Annotated

import numpy as np
import yaml
from pydantic import AfterValidator
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.app.files.findings import shown
from regrasp.app.files.resources import read_text
from regrasp.app.files.validation import validated
from regrasp.app.files.whole_file import write_whole
from regrasp.app.files.yaml_lines import parse
from regrasp.interfaces.fields import Model, Number, Vector

LENGTH_TOLERANCE = 0.01  # of a quaternion's length against 1; it is then normalized


def _unit(q: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    length = float(np.linalg.norm(q))
    if abs(length - 1.0) > LENGTH_TOLERANCE:
        raise ValueError(f"a quaternion x, y, z, w has length 1, this one {length:.3g}")
    return q


class CameraPoseFile(Model):
    """The pose of the optical frame (x right, y down, z forward) in the world."""

    position: Vector
    quaternion: Annotated[tuple[Number, Number, Number, Number], AfterValidator(_unit)]  # x, y, z, w

    @property
    def world_from_camera(self) -> RigidTransform:
        """The pose as a transform."""
        return RigidTransform.from_components(self.position, Rotation.from_quat(self.quaternion))


def load_camera_pose(path: Path) -> RigidTransform:
    """Read world_from_camera from a file. Raises `Findings` with everything that is wrong in it."""
    return validated(parse(read_text(path), shown(path)), CameraPoseFile).world_from_camera


def write_camera_pose(path: Path, world_from_camera: RigidTransform) -> None:
    """Write it as YAML. Raises OSError."""
    content = {
        "position": world_from_camera.translation.round(6).tolist(),
        "quaternion": world_from_camera.rotation.as_quat().round(9).tolist(),
    }
    write_whole(path, yaml.safe_dump(content, sort_keys=False, default_flow_style=None))
