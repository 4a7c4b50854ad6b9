"""An arm alone in an empty world."""

import numpy as np
import pybullet as p
import pytest
from robots import VX300S
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.devices import Arm
from regrasp.interfaces.hidden_world import Errors
from regrasp.interfaces.scene import EARTH_GRAVITY
from regrasp.interfaces.trajectory import Trajectory
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.sim.robot.arm import SimArm

ENCODER_STEP = 2 * np.pi / 4096  # rad
MAX_JOINT_SPEED = np.pi  # rad/s
BRAKING = 5.0  # rad/s2
TRACKING = 0.01  # rad
STOP_TIME = 0.3  # s
AT_REST = 0.01  # rad/s
TOOL_ERROR = 0.005  # m, and by how much the mean over 20 seeds may differ
TOOL_ERROR_SPREAD = 0.3
STOP_PLAY = 0.02  # rad past a joint's stop
HOME = np.zeros(6)


def make(cell: CableCell, client: int, tool_error: float = 0.0, seed: int = 0) -> SimArm:
    errors: Errors = cell.hidden.errors.model_copy(update={"arm_tool": tool_error})
    without_camera = cell.known.model_copy(update={"cameras": ()})
    hidden = cell.hidden.model_copy(update={"errors": errors})
    inexact = cell.model_copy(update={"known": without_camera, "hidden": hidden})
    return SimArm(client, inexact, "right", np.random.default_rng(seed))


def true_joints(arm: SimArm) -> FloatArray:
    states = p.getJointStates(arm.body, arm.joints, physicsClientId=arm.client)
    return np.asarray(VX300S.signs * [s[0] for s in states])


def ease(start: FloatArray, goal: FloatArray, seconds: float) -> Trajectory:
    """From rest to rest; the middle is 1.5 times as fast as the mean."""
    s = np.linspace(0.0, 1.0, 60)
    share, rate = s**2 * (3 - 2 * s), 6 * s * (1 - s) / seconds
    return Trajectory(s * seconds, start + share[:, None] * (goal - start), rate[:, None] * (goal - start))


def run(arm: SimArm, seconds: float) -> list[FloatArray]:
    """The true joints after every step."""
    path = []
    for _ in range(round(seconds * 480)):
        arm.step()
        p.stepSimulation(physicsClientId=arm.client)
        path.append(true_joints(arm))
    return path


@pytest.fixture
def arm(cell: CableCell, client: int) -> SimArm:
    return make(cell, client)


def test_it_is_an_arm(arm: SimArm) -> None:
    device: Arm = arm
    assert device.name == "right"
    assert not device.is_moving()


def test_it_sleeps_at_the_start_and_stays(cell: CableCell, arm: SimArm) -> None:
    sleep = np.array(cell.known.arm("right").sleep)
    np.testing.assert_allclose(arm.reading().positions, sleep, atol=ENCODER_STEP)
    run(arm, 0.5)
    np.testing.assert_allclose(arm.reading().positions, sleep, atol=ENCODER_STEP)


@pytest.mark.parametrize("gravity", [0.0, EARTH_GRAVITY])
def test_it_follows_a_trajectory(arm: SimArm, gravity: float) -> None:
    p.setGravity(0, 0, -gravity, physicsClientId=arm.client)
    run(arm, 0.3)
    trajectory = ease(true_joints(arm), np.array([0.8, -0.2, 0.3, -0.9, 0.5, 1.2]), 1.5)
    arm.follow(trajectory)
    assert arm.is_moving()
    path = run(arm, 2.0)
    wanted = np.array([trajectory.sample((i + 1) / 480)[0] for i in range(len(path))])
    assert float(np.abs(np.array(path) - wanted).max()) < TRACKING
    assert not arm.is_moving()


def test_it_stops_within_its_time_from_full_speed(arm: SimArm) -> None:
    start = true_joints(arm)
    full = np.array([1.0, 0.3, -0.3, -1.0, 0.4, 1.0]) * 0.95 * BRAKING * STOP_TIME  # rad/s, as trajectories are timed
    arm.follow(Trajectory(np.array([0.0, 1.0]), np.array([start, start + full]), np.array([full, full])))
    moving = run(arm, 0.3)
    at = moving[-1]
    arm.stop()
    path = np.array(run(arm, STOP_TIME))
    rates = np.array([s[1] for s in p.getJointStates(arm.body, arm.joints, physicsClientId=arm.client)])
    assert float(np.abs(np.diff(moving, axis=0)[-1] * 480).max()) > 1.2  # rad/s: it was fast
    assert float(np.abs(rates).max()) < AT_REST
    assert not arm.is_moving()
    reach = float(np.abs(path[-1] - at).max())
    assert reach == pytest.approx(float(full.max()) ** 2 / (2 * BRAKING), abs=3 * TRACKING)
    later = run(arm, 0.5)
    np.testing.assert_allclose(later[-1], path[-1], atol=1e-3)


def test_a_stop_at_rest_changes_nothing(arm: SimArm) -> None:
    before = true_joints(arm)
    arm.stop()
    assert not arm.is_moving()
    np.testing.assert_allclose(run(arm, 0.1)[-1], before, atol=1e-6)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("joint", range(6))
def test_a_joint_driven_on_stops_at_the_models_limit(arm: SimArm, joint: int, side: float) -> None:
    limits = VX300S.signs[joint] * np.array(
        p.getJointInfo(arm.body, arm.joints[joint], physicsClientId=arm.client)[8:10]
    )
    limit = side * float(np.max(side * limits))
    goal = HOME.copy()
    goal[joint] = limit + side * 0.5
    arm.follow(ease(true_joints(arm), goal, 1.5))
    run(arm, 1.8)
    assert true_joints(arm)[joint] == pytest.approx(limit, abs=STOP_PLAY)
    # What motion plans within lies within.
    assert side * limit > side * (VX300S.chain.upper if side > 0 else VX300S.chain.lower)[joint] - STOP_PLAY


def test_readings_carry_time_speed_and_effort(arm: SimArm) -> None:
    p.setGravity(0, 0, -EARTH_GRAVITY, physicsClientId=arm.client)
    arm.restart_clock()
    arm.follow(ease(true_joints(arm), HOME, 2.0))
    run(arm, 1.0)
    reading = arm.reading()
    assert reading.stamp == pytest.approx(1.0)
    assert reading.velocities[1] == pytest.approx(1.5 * 1.8 / 2.0, abs=0.05)  # rad/s, halfway of 1.8 rad
    run(arm, 1.5)
    # Stretched out forward the forearm's and hand's weight turns the elbow: 1 to 8 N m.
    assert 1.0 < abs(arm.reading().efforts[2]) < 8.0


def test_encoders_have_4096_steps(arm: SimArm) -> None:
    arm.follow(ease(true_joints(arm), HOME, 1.0))
    run(arm, 0.4)
    counts = arm.reading().positions / (2 * np.pi / 4096)
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
    np.testing.assert_allclose(arm.reading().positions, true_joints(arm), atol=ENCODER_STEP / 2 + 1e-9)


def test_tool_and_mount_are_where_the_kinematics_says(cell: CableCell, arm: SimArm) -> None:
    kinematics = ArmKinematics(VX300S, cell.known.arm("right").world_from_base)
    arm.follow(ease(true_joints(arm), np.array([0.5, -0.2, 0.4, 0.3, -0.5, 0.8]), 1.0))
    run(arm, 1.2)
    for true, believed in (
        (arm.tool_pose(), kinematics.tool(true_joints(arm))),
        (arm.deferred_mount_pose()(), kinematics.mount(true_joints(arm))),
    ):
        difference = believed.inv() * true
        assert float(np.linalg.norm(difference.translation)) < 5e-4
        assert float(difference.rotation.magnitude()) < 1e-3


def _tool_error(arm: SimArm, kinematics: ArmKinematics, q: FloatArray) -> float:
    """Distance in m of the tool from where the encoders' reading `q` puts it."""
    moved = kinematics.tool(q + arm.offsets).translation - kinematics.tool(q).translation
    return float(np.linalg.norm(moved))


def test_joint_offsets_move_the_tool_by_the_stated_error(cell: CableCell, client: int) -> None:
    kinematics = ArmKinematics(VX300S, RigidTransform.identity())
    poses = np.array(
        [[0.3, -0.6, 0.6, 0.0, 0.4, 0.0], [-0.3, 0.0, 0.2, 0.7, -0.4, 0.3], [0.9, -0.3, 0.0, 1.0, 0.9, 0.0]]
    )
    errors = []
    for seed in range(20):
        arm = make(cell, client, TOOL_ERROR, seed)
        errors.append(np.mean([_tool_error(arm, kinematics, q) for q in poses]))
        p.removeBody(arm.body, physicsClientId=client)
    assert float(np.mean(errors)) == pytest.approx(TOOL_ERROR, rel=TOOL_ERROR_SPREAD)
    assert len({round(float(e), 7) for e in errors}) == 20


def test_offsets_hide_from_the_encoders(cell: CableCell, client: int) -> None:
    arm = make(cell, client, TOOL_ERROR, seed=4)
    goal = np.array([0.2, -0.4, 0.4, 0.0, 0.3, 0.0])
    arm.follow(ease(arm.reading().positions, goal, 1.0))
    run(arm, 1.5)
    np.testing.assert_allclose(arm.reading().positions, goal, atol=2e-3)
    np.testing.assert_allclose(true_joints(arm) - goal, arm.offsets, atol=2e-3)


def test_no_stated_error_no_offsets(arm: SimArm) -> None:
    np.testing.assert_array_equal(arm.offsets, 0.0)


def test_a_servo_turns_no_faster_than_its_maker_lets_it(arm: SimArm) -> None:
    start = true_joints(arm)
    goal = start + np.array([0.5, 0.0, 0.0, 0.0, 0.0, 0.0])
    arm.follow(Trajectory(np.array([0.0, 0.02]), np.array([start, goal]), np.zeros((2, 6))))  # 25 rad/s asked for
    path = run(arm, 1.0)
    # over a tenth of a second, and a tenth more than that: a servo catches up with its target
    assert float(np.abs(np.array(path)[48:] - np.array(path)[:-48]).max() * 10) < 1.15 * MAX_JOINT_SPEED
    assert float(np.abs(path[-1] - goal).max()) < TRACKING
    assert not arm.is_moving()
