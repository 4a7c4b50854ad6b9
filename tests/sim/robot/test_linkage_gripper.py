"""The Robotiq 2F-85 on a UR5e: how far it opens, how hard it presses, and that it holds by friction."""

import numpy as np
import pybullet as p
import pytest
from jaws import THICKNESS, check_gaps, check_hold, lone_arm, run
from robots import UR5E
from scipy.spatial.transform import Rotation

from regrasp.interfaces.cable.cell import CableCell
from regrasp.sim.robot.arm import SimArm

STROKE = 0.085  # m, the maker's
MASS = 0.2  # kg


@pytest.fixture
def arm(cell: CableCell, client: int) -> SimArm:
    return lone_arm(cell, client, UR5E, (0.0, -1.57, 1.57, 0.0, 1.57, 0.0))


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
