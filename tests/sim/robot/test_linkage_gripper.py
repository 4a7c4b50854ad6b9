"""The Robotiq 2F-85 on a UR5e: how far it opens, how hard it presses, and that it holds by friction."""

import numpy as np
import pybullet as p
import pytest
from jaws import THICKNESS, check_gaps, check_hold, lone_arm, run
from robots import UR5E
from scipy.spatial.transform import Rotation

from regrasp.app.files.resources import shipped
from regrasp.app.scenario.cell_file import load_cell
from regrasp.interfaces.cable.cell import CableCell
from regrasp.sim.robot.arm import SimArm

STROKE = 0.085  # m, the maker's
MASS = 0.2  # kg
ASLEEP = (0.0, -1.57, 1.57, 0.0, 1.57, 0.0)


@pytest.fixture
def arm(cell: CableCell, client: int) -> SimArm:
    return lone_arm(cell, client, UR5E, ASLEEP)


def test_it_opens_to_the_makers_stroke_and_reads_what_it_is(arm: SimArm) -> None:
    check_gaps(arm, (STROKE, 0.04, 0.01))


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
    half, client = THICKNESS / 2, arm.client
    if shape == "box":
        solid = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.02, half, 0.02], physicsClientId=client)
    else:
        solid = p.createCollisionShape(p.GEOM_CYLINDER, radius=half, height=0.04, physicsClientId=client)
    check_hold(arm, solid, MASS, force, opening=0.07)


def block_in_jaw(arm: SimArm, force: float, seconds: float) -> int:
    """A block of 0.1 kg that the jaw has pressed with `force` N for so long."""
    half, client = THICKNESS / 2, arm.client
    arm.gripper.open(0.07)
    run(arm, 2.0)
    tool = arm.tool_pose()
    solid = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.02, half, 0.02], physicsClientId=client)
    at, turn = tool.translation.tolist(), tool.rotation.as_quat().tolist()
    body = int(p.createMultiBody(0.1, solid, -1, at, turn, physicsClientId=client))
    arm.gripper.close(force)
    run(arm, seconds)
    return body


@pytest.fixture
def printers_arm(client: int) -> SimArm:
    """With the steps and the solver of the printer's cell."""
    printer = load_cell(shipped("cell")["habitat"])
    p.setTimeStep(1.0 / printer.hidden.step_rate, physicsClientId=client)
    p.setPhysicsEngineParameter(numSolverIterations=printer.hidden.solver_iterations, physicsClientId=client)
    return lone_arm(printer, client, UR5E, ASLEEP)


def test_what_it_presses_hardly_sinks_in_with_the_solver_of_the_printers_cell(printers_arm: SimArm) -> None:
    block_in_jaw(printers_arm, 40.0, 3.0)
    assert printers_arm.gripper.true_gap() == pytest.approx(THICKNESS, abs=6e-4)


@pytest.mark.parametrize("force", [20.0, 40.0])
def test_a_pad_that_loses_its_contact_for_one_step_hardly_jumps(printers_arm: SimArm, force: float) -> None:
    """PyBullet loses it now and then; a jaw that jumps jerks the arm."""
    arm, client = printers_arm, printers_arm.client
    body = block_in_jaw(arm, force, 1.5)
    before, pad = arm.gripper.true_gap(), arm.gripper.pads[0]
    p.setCollisionFilterPair(arm.body, body, pad, -1, 0, physicsClientId=client)
    run(arm, 1 / 480)
    p.setCollisionFilterPair(arm.body, body, pad, -1, 1, physicsClientId=client)
    run(arm, 1 / 480)
    assert before - arm.gripper.true_gap() < 1e-3


def test_a_jaw_that_loses_what_it_held_closes_with_its_own_speed(arm: SimArm) -> None:
    body = block_in_jaw(arm, 40.0, 1.5)
    p.removeBody(body, physicsClientId=arm.client)
    run(arm, 0.05)
    before = arm.gripper.true_gap()
    run(arm, 0.05)
    assert (before - arm.gripper.true_gap()) / 0.05 == pytest.approx(2 * arm.robot.gripper.speed, rel=0.05)
