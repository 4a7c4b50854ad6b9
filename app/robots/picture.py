"""`regrasp robots show --picture`: a robot and its spheres as a PNG file."""

from pathlib import Path

import cv2

from regrasp.app.files.whole_file import write_named
from regrasp.interfaces.robot.robot import Robot
from regrasp.sim.robot.portrait import portrait


def write_picture(robot: Robot, path: Path) -> None:
    """Write the picture. Raises `Findings` if the file cannot be written."""
    image = cv2.imencode(".png", cv2.cvtColor(portrait(robot), cv2.COLOR_RGB2BGR))[1]
    write_named(path, image.tobytes())
