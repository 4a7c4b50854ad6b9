"""One arm in an empty world, and what any jaw must do there."""

from collections.abc import Sequence

import numpy as np
import pybullet as p
import pytest

from regrasp.interfaces.cell import ArmSpec, Cell, KnownCell
from regrasp.interfaces.hidden_world import GripperSpec
from regrasp.interfaces.robot.robot import Robot
from regrasp.interfaces.scene import EARTH_GRAVITY
from regrasp.sim.robot.arm import SimArm

GAP = 0.001  # m that a jaw may miss a gap by
THICKNESS = 0.03  # m of what is held


def lone_arm(cell: Cell, client: int, robot: Robot, sleep: Sequence[float]) -> SimArm:
    """The robot at the origin, asleep, with its own gripper."""
    spec = ArmSpec(name="one", robot=robot, base=(0.0, 0.0, 0.0), sleep=tuple(sleep))
    known = KnownCell(boxes=(), arms=(spec,), cameras=(), latencies=cell.known.latencies)
    hidden = cell.hidden.model_copy(update={"gripper": GripperSpec()})
    return SimArm(client, Cell(known=known, hidden=hidden), "one", np.random.default_rng(3))


def run(arm: SimArm, seconds: float) -> None:
    """Let time pass."""
    for _ in range(round(seconds * 480)):
        arm.step()
        p.stepSimulation(physicsClientId=arm.client)


def pads_apart(arm: SimArm) -> float:
    """Distance of the pads' collision shapes, m."""
    left, right = arm.gripper.pads
    points = p.getClosestPoints(arm.body, arm.body, 0.2, left, right, physicsClientId=arm.client)
    return float(min(point[8] for point in points))


def check_gaps(arm: SimArm, gaps: Sequence[float]) -> None:
    """The jaw opens to these gaps, m, and reads what they are."""
    for gap in gaps:
        arm.gripper.open(gap)
        run(arm, 2.0)
        assert pads_apart(arm) == pytest.approx(gap, abs=GAP)
        assert arm.gripper.true_gap() == pytest.approx(gap, abs=GAP)
        assert arm.gripper.reading().gap == pytest.approx(gap, abs=2 * GAP)


def check_hold(arm: SimArm, solid: int, mass: float, force: float, opening: float) -> None:
    """The jaw presses on a body of `THICKNESS` m with `force` N, holds it by friction alone, and lets it fall.

    `solid` is the collision shape and `mass` kg its mass; the jaw is opened `opening` m before and after.
    """
    client = arm.client
    arm.gripper.open(opening)
    run(arm, 2.0)
    tool = arm.tool_pose()
    turn = tool.rotation.as_quat().tolist()
    body = p.createMultiBody(mass, solid, -1, tool.translation.tolist(), turn, physicsClientId=client)
    p.changeDynamics(body, -1, lateralFriction=0.8, physicsClientId=client)
    arm.gripper.close(force)
    run(arm, 1.5)
    for pad in arm.gripper.pads:
        contacts = p.getContactPoints(body, arm.body, -1, pad, physicsClientId=client)
        assert sum(contact[9] for contact in contacts) == pytest.approx(force, rel=0.05)
    assert arm.gripper.true_gap() == pytest.approx(THICKNESS, abs=GAP)
    place = np.array(p.getBasePositionAndOrientation(body, physicsClientId=client)[0])
    p.setGravity(0, 0, -EARTH_GRAVITY, physicsClientId=client)
    run(arm, 2.0)
    fallen = np.array(p.getBasePositionAndOrientation(body, physicsClientId=client)[0]) - place
    assert np.linalg.norm(fallen) < 0.003
    arm.gripper.open(opening)
    run(arm, 0.5)
    assert p.getBasePositionAndOrientation(body, physicsClientId=client)[0][2] < place[2] - 0.2
