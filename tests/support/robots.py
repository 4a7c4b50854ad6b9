"""The robots of the tests, each read once, and the content of a cell file with its robots in it."""

from importlib.resources import files
from pathlib import Path
from typing import Any

import yaml

from regrasp.app.files.resources import shipped
from regrasp.app.robots.robot_file import load_robot

OWN = Path(__file__).with_name("robots")  # robot files of the tests alone
VX300S, UR5E = (load_robot(shipped("robot")[name]) for name in ("vx300s", "ur5e"))
UR5E_ON_RAIL = load_robot(OWN / "ur5e_on_rail.yaml")
PANDA = load_robot(OWN / "panda.yaml")
EVERY = {"vx300s": VX300S, "ur5e": UR5E, "ur5e_on_rail": UR5E_ON_RAIL, "panda": PANDA}


def thesis() -> Any:
    """The thesis's cell file, with the robot of its arms as the reader of cells puts it there."""
    content = yaml.safe_load((files("regrasp.scenarios") / "cells/thesis.yaml").read_text(encoding="utf-8"))
    for arm in content["known"]["arms"]:
        arm["robot"] = VX300S
        arm.setdefault("sleep", VX300S.sleep)
    return content
