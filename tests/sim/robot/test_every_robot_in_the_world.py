"""Each robot as PyBullet loads its URDF, standing or hanging: its links are where the kinematics says."""

import numpy as np
import pybullet as p
import pytest
from robots import EVERY
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.cell import ArmSpec, Cell, KnownCell
from regrasp.interfaces.hidden_world import GripperSpec
from regrasp.interfaces.robot.robot import Robot
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.sim.robot.arm import SimArm

SINGLE = 1e-6  # m, and of a rotation matrix's entries: PyBullet tells places in single precision
STANDING, HANGING = (0.0, 0.0, 0.0), (180.0, -15.0, 40.0)  # roll, pitch and yaw, degrees
EVERY_ROBOT = pytest.mark.parametrize("name", EVERY)
EVERY_BASE = pytest.mark.parametrize("turn", [STANDING, HANGING], ids=["standing", "hanging"])


def arm_of(
    cell: CableCell, client: int, robot: Robot, turn: tuple[float, float, float]
) -> tuple[SimArm, ArmKinematics]:
    spec = ArmSpec(name="one", robot=robot, base=(0.3, -0.2, 0.9), base_rpy_deg=turn, sleep=robot.sleep)
    known = KnownCell(boxes=(), arms=(spec,), cameras=(), latencies=cell.known.latencies)
    hidden = cell.hidden.model_copy(update={"gripper": GripperSpec()})  # as its file says
    arm = SimArm(client, Cell(known=known, hidden=hidden), "one", np.random.default_rng(0))
    return arm, ArmKinematics(robot, spec.world_from_base)


def links_in_the_world(arm: SimArm, names: list[str]) -> FloatArray:
    """Poses (n, 4, 4) by PyBullet."""
    numbers = [arm.links[name] for name in names]
    states = p.getLinkStates(arm.body, numbers, 0, 1, physicsClientId=arm.client)
    places = RigidTransform.from_components([s[4] for s in states], Rotation.from_quat([s[5] for s in states]))
    return np.asarray(places.as_matrix())


def drawn(kin: ArmKinematics, count: int) -> FloatArray:
    return np.random.default_rng(1).uniform(kin.lower, kin.upper, (count, len(kin)))


@EVERY_BASE
@EVERY_ROBOT
def test_the_tool_is_where_the_kinematics_says(
    cell: CableCell, client: int, name: str, turn: tuple[float, float, float]
) -> None:
    robot = EVERY[name]
    arm, kin = arm_of(cell, client, robot, turn)
    link_from_tool = np.eye(4)
    link_from_tool[:3, :3] = Rotation.from_euler("xyz", robot.tool.rpy).as_matrix()
    link_from_tool[:3, 3] = robot.tool.xyz
    for q in drawn(kin, 1000):
        arm.place(q)
        (link,) = links_in_the_world(arm, [robot.tool.link])
        np.testing.assert_allclose(kin.tool_matrix(q), link @ link_from_tool, rtol=0, atol=SINGLE)


@EVERY_BASE
@EVERY_ROBOT
def test_all_links_are_where_the_kinematics_says_however_far_the_jaw_is_open(
    cell: CableCell, client: int, name: str, turn: tuple[float, float, float]
) -> None:
    robot = EVERY[name]
    arm, kin = arm_of(cell, client, robot, turn)
    names = [link for link in robot.tree.links if link in arm.links]
    for q, share in zip(drawn(kin, 20), np.linspace(0.0, 1.0, 20), strict=True):
        opening = robot.gripper.closed + float(share) * (robot.gripper.opening - robot.gripper.closed)
        arm.place(q)
        arm.gripper.place_at(opening)
        frames, places = kin.link_frames(q), [robot.link_place(link, opening) for link in names]
        expected = [frames[index] @ link_from_part for index, link_from_part in places]
        np.testing.assert_allclose(links_in_the_world(arm, names), expected, rtol=0, atol=SINGLE)


@pytest.mark.parametrize("name", ["vx300s", "ur5e", "ur5e_on_rail"])
def test_a_hanging_arm_says_where_it_is(cell: CableCell, client: int, name: str) -> None:
    robot = EVERY[name]
    arm, kin = arm_of(cell, client, robot, HANGING)
    for q in drawn(kin, 20):
        arm.place(q)
        step = robot.calibration.encoder_step
        np.testing.assert_allclose(arm.reading().positions, q, atol=0.5 * step + 1e-9)
        np.testing.assert_allclose(arm.deferred_mount_pose()().as_matrix(), kin.mount(q).as_matrix(), atol=SINGLE)
        np.testing.assert_allclose(arm.tool_pose().rotation.as_matrix(), kin.tool(q).rotation.as_matrix(), atol=SINGLE)


@pytest.mark.parametrize("opening", [0.01, 0.02, 0.05, 0.08])
@pytest.mark.parametrize("name", ["ur5e", "vx300s"])
def test_the_pads_stand_as_far_apart_as_the_jaw_is_open(
    cell: CableCell, client: int, name: str, opening: float
) -> None:
    robot = EVERY[name]
    arm, _ = arm_of(cell, client, robot, STANDING)
    opening = min(opening, robot.gripper.opening)
    arm.gripper.place_at(opening)
    assert arm.gripper.true_gap() == pytest.approx(opening, abs=1e-4)
    left, right = arm.gripper.pads
    nearest = p.getClosestPoints(arm.body, arm.body, 0.2, left, right, physicsClientId=client)
    assert min(point[8] for point in nearest) == pytest.approx(opening, abs=5e-4)
