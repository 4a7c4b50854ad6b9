"""The Robotiq 2F-85 on a UR5e: how far it opens, how hard it presses, and that it holds by friction."""

import numpy as np
import pybullet as p
import pytest
from robots import UR5E
from scipy.spatial.transform import Rotation

from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.cell import ArmSpec, Cell, KnownCell
from regrasp.interfaces.hidden_world import GripperSpec
from regrasp.interfaces.scene import EARTH_GRAVITY
from regrasp.sim.robot.arm import SimArm

STROKE = 0.085  # m, the maker's
GAP = 0.001  # m
THICKNESS = 0.03  # m of the block
MASS = 0.2  # kg


@pytest.fixture
def arm(cell: CableCell, client: int) -> SimArm:
    spec = ArmSpec(name="one", robot=UR5E, base=(0.0, 0.0, 0.0), sleep=(0.0, -1.57, 1.57, 0.0, 1.57, 0.0))
    known = KnownCell(boxes=(), arms=(spec,), cameras=(), latencies=cell.known.latencies)
    hidden = cell.hidden.model_copy(update={"gripper": GripperSpec()})
    return SimArm(client, Cell(known=known, hidden=hidden), "one", np.random.default_rng(3))


def run(arm: SimArm, seconds: float) -> None:
    for _ in range(round(seconds * 480)):
        arm.step()
        p.stepSimulation(physicsClientId=arm.client)


def pads_apart(arm: SimArm) -> float:
    """Distance of the pads' collision shapes, m."""
    left, right = arm.gripper.pads
    points = p.getClosestPoints(arm.body, arm.body, 0.2, left, right, physicsClientId=arm.client)
    return float(min(point[8] for point in points))


def test_it_opens_to_the_makers_stroke_and_reads_what_it_is(arm: SimArm) -> None:
    for gap in (STROKE, 0.04, 0.01):
        arm.gripper.open(gap)
        run(arm, 2.0)
        assert pads_apart(arm) == pytest.approx(gap, abs=GAP)
        assert arm.gripper.true_gap() == pytest.approx(gap, abs=GAP)
        assert arm.gripper.reading().gap == pytest.approx(gap, abs=2 * GAP)


def test_the_pads_stay_parallel(arm: SimArm) -> None:
    for gap in (0.07, 0.02):
        arm.gripper.open(gap)
        run(arm, 2.0)
        states = p.getLinkStates(arm.body, arm.gripper.pads, 0, 1, physicsClientId=arm.client)
        left, right = (Rotation.from_quat(state[5]) for state in states)
        axes = [turn.apply([0.0, 1.0, 0.0]) for turn in (left, right)]
        assert abs(float(axes[0] @ axes[1])) > np.cos(np.deg2rad(1.0))


@pytest.mark.parametrize("force", [20.0, 40.0])  # N of each finger; the least by the maker, and what grips a connector
@pytest.mark.parametrize("shape", ["box", "cylinder"])
def test_it_presses_with_the_force_that_it_is_told_and_holds_a_block_by_friction(
    arm: SimArm, force: float, shape: str
) -> None:
    arm.gripper.open(0.07)
    run(arm, 2.0)
    tool, client = arm.tool_pose(), arm.client
    if shape == "box":
        solid = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.02, THICKNESS / 2, 0.02], physicsClientId=client)
    else:
        solid = p.createCollisionShape(p.GEOM_CYLINDER, radius=THICKNESS / 2, height=0.04, physicsClientId=client)
    turn = tool.rotation.as_quat().tolist()
    block = p.createMultiBody(MASS, solid, -1, tool.translation.tolist(), turn, physicsClientId=client)
    p.changeDynamics(block, -1, lateralFriction=0.8, physicsClientId=client)
    arm.gripper.close(force)
    run(arm, 1.5)
    for pad in arm.gripper.pads:
        contacts = p.getContactPoints(block, arm.body, -1, pad, physicsClientId=client)
        assert sum(contact[9] for contact in contacts) == pytest.approx(force, rel=0.05)
    assert arm.gripper.true_gap() == pytest.approx(THICKNESS, abs=GAP)
    place = np.array(p.getBasePositionAndOrientation(block, physicsClientId=client)[0])
    p.setGravity(0, 0, -EARTH_GRAVITY, physicsClientId=client)
    run(arm, 2.0)
    fallen = np.array(p.getBasePositionAndOrientation(block, physicsClientId=client)[0]) - place
    assert np.linalg.norm(fallen) < 0.003
    arm.gripper.open(0.07)
    run(arm, 0.5)
    assert p.getBasePositionAndOrientation(block, physicsClientId=client)[0][2] < place[2] - 0.2
