"""What the tests make an arm and its hand do: reach the connector, close on it, draw it along a line."""

from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.trajectory import Trajectory
from regrasp.motion.grasping.grasps import grasp_candidates
from regrasp.motion.robots.answers import wrap
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.sim.cable.objects import CableObjects
from regrasp.sim.world import World

STANDOFF = 0.06  # m before the grasp
SHALLOW = 0.006  # m nearer to the finger tips: keeps the pads' corners off the panel behind the plug
GRIP_FORCE = 20.0  # N a finger
GENTLE = 0.0005  # m: the jaw closes by so much at speed; from farther the blow alone throws the plug out of its socket


def drive(world: World[Any], arm: str, goal: FloatArray, seconds: float) -> None:
    """Move an arm to the joints `goal` (6,) rad from rest to rest and wait a little."""
    start = world.arms[arm].reading().positions
    s = np.linspace(0.0, 1.0, 40)
    share, rate = s**2 * (3 - 2 * s), 6 * s * (1 - s) / seconds
    path = start + share[:, None] * (goal - start)
    world.arms[arm].follow(Trajectory(s * seconds, path, rate[:, None] * (goal - start)))
    world.advance(seconds + 0.1)


def kinematics(world: World[Any], arm: str) -> ArmKinematics:
    spec = world.cell.known.arm(arm)
    return ArmKinematics(spec.robot, spec.world_from_base)


def nearest(solutions: FloatArray, q: FloatArray) -> FloatArray:
    return np.asarray(min(solutions, key=lambda s: float(np.abs(wrap(s - q)).max())))


def take_hold(world: World[CableObjects]) -> None:
    """Bring the hand round the connector by the preferred grasp and close it."""
    known = world.objects.cell.known.cable
    hand, connector = known.hand, known.connector
    robot, arm = kinematics(world, hand), world.arms[hand]
    arm.gripper.open(0.06)
    for grasp in grasp_candidates(world.objects.connector_pose(), connector.length, connector.radius, shallow=SHALLOW):
        back = grasp.world_from_tool * RigidTransform.from_translation([-STANDOFF, 0.0, 0.0])
        before, at = robot.ik(back), robot.ik(grasp.world_from_tool)
        if len(before) and len(at):
            break
    start = nearest(before, arm.reading().positions)
    drive(world, hand, start, 2.5)
    drive(world, hand, nearest(at, start), 0.8)
    arm.gripper.open(2 * connector.radius + GENTLE)
    world.advance(1.0)
    arm.gripper.close(GRIP_FORCE)
    world.advance(0.6)


def draw(world: World[CableObjects], way: FloatArray, seconds: float) -> None:
    """Move the hand by `way` (3,) m along a line without turning it, and wait a little."""
    start_to_draw(world, way, seconds)
    world.advance(seconds + 0.1)


def start_to_draw(world: World[CableObjects], way: FloatArray, seconds: float, steps: int = 5) -> None:
    """Let the hand begin to move by `way` (3,) m along a line."""
    hand = world.objects.cell.known.cable.hand
    robot, arm = kinematics(world, hand), world.arms[hand]
    path = [arm.reading().positions]
    tool = robot.tool(path[0])
    for share in np.linspace(0.0, 1.0, steps + 1)[1:]:
        path.append(nearest(robot.ik(RigidTransform.from_translation(share * way) * tool), path[-1]))
    times = np.linspace(0.0, seconds, len(path))
    rates = np.gradient(np.array(path), times, axis=0)
    rates[[0, -1]] = 0.0
    arm.follow(Trajectory(times, np.array(path), rates))
