"""The robots of the tests, each read once, and the content of a cell file with its robots in it."""

from importlib.resources import files
from typing import Any

import yaml

from regrasp.app.files.resources import shipped
from regrasp.app.robots.robot_file import load_robot

VX300S = load_robot(shipped("robot")["vx300s"])


def thesis() -> Any:
    """The thesis's cell file, with the robot of its arms as the reader of cells puts it there."""
    content = yaml.safe_load((files("regrasp.scenarios") / "cells/thesis.yaml").read_text(encoding="utf-8"))
    for arm in content["known"]["arms"]:
        arm["robot"] = VX300S
    return content
