"""PyBullet's own inverse kinematics of a robot, to compare ours with."""

import numpy as np
import pybullet as p
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.robot.robot import Robot
from regrasp.interfaces.robot.urdf import pose_of
from regrasp.sim.robot.load import link_numbers, load_robot_body


class BulletIk:
    """A robot alone in a client of its own, whose joints are at zero when a search begins."""

    def __init__(self, robot: Robot, world_from_base: RigidTransform) -> None:
        self._client: int = p.connect(p.DIRECT)
        self._body, joints = load_robot_body(self._client, robot, world_from_base)
        links = link_numbers(self._client, self._body)
        self._link, self._signs = links[robot.tool.link], robot.signs
        turn = p.getDynamicsInfo(self._body, self._link, physicsClientId=self._client)[4]
        tool_from_link = RigidTransform.from_matrix(pose_of(robot.tool.xyz, robot.tool.rpy)).inv()
        # It brings the link's origin to the place, but turns the axes of its inertia as is asked.
        self._tool_from_target = tool_from_link * RigidTransform.from_rotation(Rotation.from_quat(turn))
        infos = [p.getJointInfo(self._body, link, physicsClientId=self._client) for link in links.values()]
        movable = sorted(info[0] for info in infos if info[2] != p.JOINT_FIXED)
        self._rows = [movable.index(joint) for joint in joints]

    def solve(self, world_from_tool: FloatArray, iterations: int) -> FloatArray:
        """Its answer (1, n) for a pose (4, 4) of the tool, right or wrong."""
        target = RigidTransform.from_matrix(world_from_tool) * self._tool_from_target
        found = p.calculateInverseKinematics(
            self._body,
            self._link,
            target.translation.tolist(),
            target.rotation.as_quat().tolist(),
            maxNumIterations=iterations,
            residualThreshold=1e-5,
            physicsClientId=self._client,
        )
        return np.asarray(self._signs * np.array(found)[self._rows])[None]

    def close(self) -> None:
        """Disconnect the client."""
        p.disconnect(self._client)
