"""What is wrong with a robot file beyond its form and its URDF: its limits, poses and spheres."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.files.yaml_lines import Document
from regrasp.app.robots.cover import LinkMeasure, measure_cover
from regrasp.app.robots.meshes import surfaces
from regrasp.app.robots.robot_file import read_robot
from regrasp.app.robots.self_collision import Pair, meetings
from regrasp.interfaces.robot.consistency import Found, Where
from regrasp.interfaces.robot.parts import Joint
from regrasp.interfaces.robot.robot import Robot
from regrasp.interfaces.robot.urdf import RobotError, pose_of

MEASURED_TO = 0.001  # m to which a cover is measured
SELF_OVERLAP = 0.008  # m that spheres of one arm may overlap, as the planners allow it: they stand out of the meshes
MOST_TURNED_DEG = 5.0  # of the tool's y from the way in which the fingers close
MOST_OFF = 0.02  # m of the tool from the pads' middle; choice: a linkage's pads move by 14 mm along the fingers
_OPENINGS = 9  # at which the pads' middle is looked at
_CLOSE = 1e-6  # rad or m by which a limit may be rounded


def check_robot(path: Path) -> list[LinkMeasure]:
    """The measured cover of a robot file in which nothing is wrong. Raises `Findings` otherwise."""
    robot, document = read_robot(path)
    _raise(document, [*_limits(robot), *_poses(robot), *_tool(robot), *_bare(robot, path)])
    try:
        measures = measure_cover(robot)
    except RobotError as error:
        raise Findings([Finding(*document.place(error.path), str(error))]) from None
    _raise(document, [*_bare_links(robot, measures, path), *_cover(robot, measures, path)])
    return measures


def _raise(document: Document, found: list[Found]) -> None:
    if found:
        raise Findings([Finding(*document.place(path), message) for path, message in found])


def _limits(robot: Robot) -> Iterator[Found]:
    """Limits that the file sets beyond those of the URDF."""
    for i, joint in enumerate(robot.joints):
        known = dict(robot.tree.joints[joint.in_urdf].limits)
        if robot.tree.joints[joint.in_urdf].kind == "continuous":
            known = {key: value for key, value in known.items() if key not in ("lower", "upper")}
        if joint.sign < 0:
            ends = {"lower": known.get("upper"), "upper": known.get("lower")}
            known |= {key: -value for key, value in ends.items() if value is not None}
        for key, said, limit in _said(joint, known):
            where = "below" if key == "lower" else "above"
            yield ("joints", i, key), f"{key} {said:g} of {joint.name} is {where} the URDF's {limit:g}; stay within it"


def _said(joint: Joint, known: dict[str, float]) -> Iterator[tuple[str, float, float]]:
    words = {"lower": "lower", "upper": "upper", "speed": "velocity", "torque": "effort"}
    for key, word in words.items():
        said, limit = getattr(joint, key), known.get(word)
        if said is not None and limit is not None and (limit - said if key == "lower" else said - limit) > _CLOSE:
            yield key, said, limit


def _poses(robot: Robot) -> Iterator[Found]:
    """Poses of the file beyond the limits, or in which the robot meets itself."""
    chain = robot.chain
    named: list[tuple[Where, tuple[float, ...]]] = [(("sleep",), robot.sleep)]
    named += [(("calibration", "poses", i), pose) for i, pose in enumerate(robot.calibration.poses)]
    meeting: dict[Pair, list[tuple[Where, float]]] = {}
    for path, pose in named:
        values = np.array(pose)
        out = np.flatnonzero((values < chain.lower - _CLOSE) | (values > chain.upper + _CLOSE))
        for i in out:
            ends = f"{chain.lower[i]:g} to {chain.upper[i]:g}"
            yield path, f"{values[i]:g} of {chain.names[i]} is beyond its limits, {ends}; give one between them"
        for pair, depth in meetings(robot, values, SELF_OVERLAP):
            meeting.setdefault(pair, []).append((path, depth))
    for (a, b), places in meeting.items():
        more = f", and in {len(places) - 1} more poses" if places[1:] else ""
        message = f"here{more} the spheres of {a} and {b} overlap by {1000 * max(d for _, d in places):.1f} mm; at most"
        yield places[0][0], f"{message} {1000 * SELF_OVERLAP:.0f} mm are let pass: change the pose, or the spheres"


def _tool(robot: Robot) -> Iterator[Found]:
    """A tool that is turned from the way in which the fingers close, or is not between the pads."""
    opened, *others = (
        robot.pad_places(float(gap)) for gap in np.linspace(robot.gripper.opening, robot.gripper.closed, _OPENINGS)
    )
    tool = robot.tree.frame(robot.tool.link) @ pose_of(robot.tool.xyz, robot.tool.rpy)
    apart = opened[0] - opened[1]
    cosine = abs(float(tool[:3, 1] @ apart)) / float(np.linalg.norm(apart))
    if cosine < np.cos(np.deg2rad(MOST_TURNED_DEG)):
        turned = np.rad2deg(np.arccos(min(cosine, 1.0)))
        message = f"the tool's y is turned by {turned:.0f} degrees from the way in which the fingers close"
        yield ("tool", "rpy"), f"{message}; correct rpy: y goes that way, x along the fingers"
    off = min(float(np.linalg.norm(tool[:3, 3] - places.mean(axis=0))) for places in [opened, *others])
    if off > MOST_OFF:
        middle = np.linalg.inv(robot.tree.frame(robot.tool.link)) @ np.append(opened.mean(axis=0), 1.0)
        place = ", ".join(f"{value:.4g}" for value in np.round(middle[:3], 4) + 0.0)
        message = f"the tool lies {1000 * off:.0f} mm from the pads' middle, however far the jaw is open"
        right = f"by pads and rpy that is at [{place}] in {robot.tool.link}"
        yield ("tool", "xyz"), f"{message}; {right}: correct xyz, rpy (x along the fingers), or the pads"


def _bare(robot: Robot, path: Path) -> Iterator[Found]:
    if not robot.spheres:
        yield ("spheres",), f"no spheres; `regrasp robots spheres {shown(path)}` fits them"


def _bare_links(robot: Robot, measures: list[LinkMeasure], path: Path) -> Iterator[Found]:
    """Moving links of whose rigid group no link has spheres."""
    geometry = surfaces(robot.element())
    for m in measures:
        if m.moves and not m.group and m.link in geometry:
            yield ("spheres",), f"{m.link} has a mesh and moves, but no spheres; {_remedy(m.link, path)}"


def _cover(robot: Robot, measures: list[LinkMeasure], path: Path) -> Iterator[Found]:
    for m in measures:
        outside, excess = robot.cover.of(m.link)
        place = ("spheres", m.link) if m.link in robot.spheres else ("spheres",)
        if m.outside is not None and m.outside > outside + MEASURED_TO:
            message = f"spheres that leave a mesh uncovered: {m.link} lies up to {1000 * m.outside:.1f} mm outside"
            yield place, f"{message}, and the cover promises {1000 * outside:.1f} mm; {_remedy(m.link, path)}"
        if m.moves and m.excess is not None and m.excess > excess + MEASURED_TO:
            message = f"the spheres of {m.link} stand out by up to {1000 * m.excess:.1f} mm"
            yield place, f"{message}, and the cover promises {1000 * excess:.1f} mm; use more and smaller ones"


def _remedy(link: str, path: Path) -> str:
    return f"`regrasp robots spheres {shown(path)} --links {link}` fits them"
