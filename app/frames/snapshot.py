"""`regrasp snapshot`: writes a scenario's first frames as files that `regrasp perceive` reads."""

from pathlib import Path

import cv2
import numpy as np

from regrasp.app.files.whole_file import write_whole
from regrasp.app.frames.calibration_file import CalibrationFile, write_calibration
from regrasp.app.frames.camera_pose_file import write_camera_pose
from regrasp.app.run.compose import build_world
from regrasp.app.scenario.load import Scenario
from regrasp.interfaces.cell import FixedMount
from regrasp.interfaces.frame import RgbdFrame

DEPTH_COUNTS_PER_METRE = 1000.0  # the depth file counts millimetres


def write_snapshot(scenario: Scenario, camera: str, count: int, out: Path) -> None:
    """Write `count` frames of a camera to the folder `out`, its intrinsics and, if it is fixed, its nominal pose."""
    spec = scenario.cell.known.camera(camera)
    world = build_world(scenario, scenario.file.seed)
    try:
        for number in range(1, count + 1):
            while (frame := world.cameras[camera].latest()) is None or frame.number < number:
                world.advance(world.step_seconds)
            write_frame(out, frame, "" if count == 1 else f"_{number:03}")
    finally:
        world.close()
    if isinstance(spec.mount, FixedMount):
        write_camera_pose(out / "camera_pose.yaml", spec.mount.world_from_camera)


def write_picture(scenario: Scenario, seed: int, camera: str, out: Path) -> None:
    """Write the first colour picture of a camera to the file `out`, as JPEG. Raises OSError."""
    world = build_world(scenario, seed)
    try:
        while (frame := world.cameras[camera].latest()) is None:
            world.advance(world.step_seconds)
    finally:
        world.close()
    write_whole(out, cv2.imencode(".jpg", cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2BGR))[1].tobytes())


def write_frame(out: Path, frame: RgbdFrame, suffix: str = "") -> None:
    """Write rgb.png, depth.png (16 bit, millimetres) and intrinsics.yaml to a folder. Raises OSError."""
    out.mkdir(parents=True, exist_ok=True)
    depth = np.rint(DEPTH_COUNTS_PER_METRE * frame.depth).astype(np.uint16)
    for name, image in (("rgb", cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2BGR)), ("depth", depth)):
        write_whole(out / f"{name}{suffix}.png", cv2.imencode(".png", image)[1].tobytes())
    k = frame.intrinsics
    file = CalibrationFile(width=k.width, height=k.height, fx=k.fx, fy=k.fy, cx=k.cx, cy=k.cy)
    write_calibration(out / "intrinsics.yaml", file)
