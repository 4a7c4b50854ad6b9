"""Loads a robot into PyBullet."""

import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pybullet as p
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.robot.robot import Robot
from regrasp.sim.robot.convex import split_concave
from regrasp.sim.robot.model import robot_urdf


def load_robot_body(
    client: int,
    robot: Robot,
    world_from_base: RigidTransform,
    camera_offset: tuple[float, float, float] | None = None,
) -> tuple[int, list[int]]:
    """The body, and PyBullet's numbers of its driven joints; all damping is off. `camera_offset`: see `robot_urdf`."""
    root_from_base = robot.tree.frame(robot.base_link)
    root = world_from_base
    if not np.array_equal(root_from_base, np.eye(4)):
        root = world_from_base * RigidTransform.from_matrix(root_from_base).inv()
    with tempfile.TemporaryDirectory() as folder:
        path, urdf = Path(folder) / "robot.urdf", ET.fromstring(robot_urdf(robot, camera_offset))
        split_concave(urdf, Path(folder))
        path.write_text(ET.tostring(urdf, encoding="unicode"), encoding="utf-8")
        body = p.loadURDF(
            str(path),
            root.translation.tolist(),
            root.rotation.as_quat().tolist(),
            useFixedBase=True,
            flags=p.URDF_USE_INERTIA_FROM_FILE,
            physicsClientId=client,
        )
    for link in range(-1, p.getNumJoints(body, physicsClientId=client)):
        p.changeDynamics(body, link, linearDamping=0, angularDamping=0, jointDamping=0, physicsClientId=client)
    joints = joint_numbers(client, body)
    return int(body), [joints[name] for name in robot.urdf_joints]


def joint_numbers(client: int, body: int) -> dict[str, int]:
    """PyBullet's numbers of a body's joints by name."""
    return _numbers(client, body, 1)


def link_numbers(client: int, body: int) -> dict[str, int]:
    """PyBullet's numbers of a body's links by name; the base has none."""
    return _numbers(client, body, 12)


def _numbers(client: int, body: int, field: int) -> dict[str, int]:
    infos = [
        p.getJointInfo(body, j, physicsClientId=client) for j in range(p.getNumJoints(body, physicsClientId=client))
    ]
    return {info[field].decode(): info[0] for info in infos}
