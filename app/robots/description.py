"""A robot in words and numbers, for people and for programs."""

from typing import Any

import numpy as np

from regrasp.app.robots.reach import Reach, reach_of
from regrasp.interfaces.robot.robot import Robot


def described(robot: Robot) -> dict[str, Any]:
    """What a robot is, in SI units: its joints, tool, gripper, rail, spheres and reach."""
    chain, gripper = robot.chain, robot.gripper
    names = ("lower", "upper", "speed", "acceleration", "torque")
    limits = zip(chain.lower, chain.upper, chain.speeds, chain.accelerations, chain.torques, strict=True)
    return {
        "title": robot.title,
        "joints": [
            {"name": name, "slides": bool(slides)} | dict(zip(names, map(float, row), strict=True))
            for name, slides, row in zip(chain.names, chain.slides, limits, strict=True)
        ],
        "tool": robot.tool.model_dump(mode="json"),
        "camera_mount": None if robot.mount is None else robot.mount.link,
        "gripper": {key: getattr(gripper, key) for key in ("type", "opening", "closed", "force", "speed", "friction")},
        "spheres": {link: len(rows) for link, rows in robot.spheres.items()},
        "self_collision": len(robot.self_collision),
        "cover": robot.cover.model_dump(mode="json", exclude_none=True),
        "reach": vars(_reach(robot)),
    }


def described_in_words(robot: Robot) -> list[str]:
    """The same as lines of text, angles in degrees."""
    data = described(robot)
    grip, reach = data["gripper"], data["reach"]
    count = sum(data["spheres"].values())
    return [
        robot.title,
        "",
        *_joint_table(data["joints"]),
        "",
        f"tool     on {robot.tool.link}, at {', '.join(f'{value:g}' for value in robot.tool.xyz)} m",
        f"camera   {'no mount' if robot.mount is None else 'can be mounted on ' + robot.mount.link}",
        f"gripper  {grip['type']}: opens {1000 * grip['opening']:g} mm, {grip['force']:g} N and "
        f"{1000 * grip['speed']:g} mm/s a finger, friction {grip['friction']:g}",
        f"spheres  {count} on {len(data['spheres'])} links; {len(robot.self_collision)} pairs of links can meet",
        f"reach    the tool gets {reach['nearest']:.2f} to {reach['farthest']:.2f} m far from the shoulder, and "
        f"{reach['lowest']:.2f} to {reach['highest']:.2f} m high over the base",
        "         (found in 20,000 random joint positions; links in the way do not count)",
    ]


def _reach(robot: Robot) -> Reach:
    chain = robot.chain if robot.rail is None else robot.chain.without(1)
    return reach_of(chain)


def _joint_table(joints: list[dict[str, Any]]) -> list[str]:
    width = max(len(joint["name"]) for joint in joints)
    lines = [f"{'joint':<{width}}  {'from':>9}  {'to':>9}  {'speed':>11}  {'acceleration':>13}  {'at most':>8}"]
    for joint in joints:
        unit, torque = ("m", "N") if joint["slides"] else ("deg", "N m")
        scale = 1.0 if joint["slides"] else float(np.rad2deg(1.0))
        lower, upper, speed, acceleration = (
            f"{scale * joint[key]:.{2 if joint['slides'] else 0}f} {unit}"
            for key in ("lower", "upper", "speed", "acceleration")
        )
        row = f"{joint['name']:<{width}}  {lower:>9}  {upper:>9}  {speed + '/s':>11}  {acceleration + '/s2':>13}"
        lines.append(f"{row}  {joint['torque']:g} {torque}")
    return lines
