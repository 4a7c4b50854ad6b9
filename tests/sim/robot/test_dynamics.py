"""Each robot's rigid-body dynamics against PyBullet's, and what a contact guard makes of its drives' efforts."""

from dataclasses import replace

import numpy as np
import pybullet as p
import pytest
from robots import EVERY, VX300S
from scipy.spatial.transform import RigidTransform, Rotation
from test_every_robot_in_the_world import arm_of

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.reading import JointReading
from regrasp.interfaces.robot.robot import Robot
from regrasp.interfaces.scene import EARTH_GRAVITY
from regrasp.motion.planning.timing import JointLimits, time_path
from regrasp.motion.robots.contact_guard import ContactGuard, ContactGuardParameters, ContactLimits
from regrasp.motion.robots.contact_place import contact_place
from regrasp.motion.robots.dynamics import ArmDynamics
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.scene.collision import CollisionModel
from regrasp.sim.robot.load import joint_numbers, link_numbers, load_robot_body
from regrasp.sim.scene import FoamParameters

DOWN = np.array([0.0, 0.0, -EARTH_GRAVITY])
UPRIGHT, HANGING = (0.0, 0.0, 0.0), (180.0, -15.0, 40.0)
FREE = ContactGuardParameters().free
EVERY_ROBOT = pytest.mark.parametrize("name", EVERY)


@EVERY_ROBOT
def test_efforts_are_pybullet_s(client: int, name: str) -> None:
    # Upright only: PyBullet's inverse dynamics leave out how the base is turned.
    robot, rng = EVERY[name], np.random.default_rng(0)
    dynamics = ArmDynamics(robot, RigidTransform.from_matrix(robot.tree.frame(robot.base_link)))
    body, _ = load_robot_body(client, robot, RigidTransform.from_matrix(robot.tree.frame(robot.base_link)))
    numbers, links = joint_numbers(client, body), link_numbers(client, body)
    for link in {"left_pad", "right_pad"} & links.keys():  # the world's own
        p.changeDynamics(body, links[link], mass=0, localInertiaDiagonal=[0, 0, 0], physicsClientId=client)
    p.setGravity(*DOWN, physicsClientId=client)
    infos = [
        p.getJointInfo(body, j, physicsClientId=client) for j in range(p.getNumJoints(body, physicsClientId=client))
    ]
    movable = [info[0] for info in infos if info[2] != p.JOINT_FIXED]
    jaw = robot.gripper_positions(0.5 * robot.gripper.opening)
    for _ in range(200):
        q = rng.uniform(robot.chain.lower, robot.chain.upper)
        v, a = rng.normal(scale=1.5, size=(2, len(q)))
        told = [dict(zip(robot.urdf_joints, robot.signs * values, strict=True)) for values in (q, v, a)]
        told[0] |= jaw
        by_number = [{numbers[joint]: value for joint, value in part.items()} for part in told]
        rows = [[part.get(joint, 0.0) for joint in movable] for part in by_number]
        theirs = p.calculateInverseDynamics(body, *rows, physicsClientId=client)
        expected = robot.signs * [theirs[movable.index(numbers[joint])] for joint in robot.urdf_joints]
        np.testing.assert_allclose(dynamics.efforts(q, v, a, DOWN), expected, atol=1e-6)


@EVERY_ROBOT
def test_a_turned_base_is_turned_gravity(name: str) -> None:
    robot, rng = EVERY[name], np.random.default_rng(1)
    turn = Rotation.from_euler("xyz", HANGING, degrees=True)
    turned = ArmDynamics(robot, RigidTransform.from_components([0.3, 0.2, 1.0], turn))
    upright = ArmDynamics(robot, RigidTransform.identity())
    for q in rng.uniform(robot.chain.lower, robot.chain.upper, (20, len(robot.chain))):
        v, a = rng.normal(size=(2, len(q)))
        np.testing.assert_allclose(
            turned.efforts(q, v, a, DOWN), upright.efforts(q, v, a, turn.inv().apply(DOWN)), atol=1e-9
        )


@EVERY_ROBOT
def test_a_pull_turns_the_joints_by_the_transposed_jacobian(name: str) -> None:
    robot, rng = EVERY[name], np.random.default_rng(2)
    base = RigidTransform.from_components([0.3, 0.2, 1.0], Rotation.from_euler("xyz", HANGING, degrees=True))
    dynamics, kin = ArmDynamics(robot, base), ArmKinematics(robot, base)
    for q in rng.uniform(robot.chain.lower, robot.chain.upper, (20, len(robot.chain))):
        force = rng.normal(size=3)
        at_tool = dynamics.efforts_of_pull(q, np.array([0.0, 0.0, 0.0, *force]))
        np.testing.assert_allclose(at_tool, kin.jacobian(q)[:3].T @ kin.tool(q).rotation.apply(force), atol=1e-12)


class Bench:
    """One arm in an empty client, that follows paths under a guard."""

    def __init__(self, cell: CableCell, client: int, robot: Robot, turn: tuple[float, float, float], gravity: float):
        self.client = client
        p.setGravity(0, 0, -gravity, physicsClientId=client)
        p.setTimeStep(1 / cell.hidden.step_rate, physicsClientId=client)
        self.arm, self.kin = arm_of(cell, client, robot, turn)
        self.dynamics = ArmDynamics(robot, RigidTransform.from_matrix(self.kin.base))

    def step(self, count: int = 1) -> None:
        for _ in range(count):
            self.arm.step()
            p.stepSimulation(physicsClientId=self.client)

    def place(self, q: FloatArray) -> None:
        self.arm.place(q)
        self.step(48)

    def follow(
        self, goal: FloatArray, body: int | None = None, speed: float = 1.0, limits: ContactLimits = FREE
    ) -> tuple[ContactGuard, float]:
        """Move there at a share of full speed: the guard, and the greatest force (N) on a body."""
        chain = self.kin.chain
        path = np.array([self.arm.reading().positions, goal])
        guard = ContactGuard(self.dynamics, self.arm.gravity(), chain.torques, limits)
        self.arm.follow(time_path(path, JointLimits(chain.speeds, chain.accelerations), speed), guard)
        peak = 0.0
        while self.arm.is_moving():
            self.step()
            if body is not None:
                contacts = p.getContactPoints(self.arm.body, body, physicsClientId=self.client)
                peak = max(peak, sum(contact[9] for contact in contacts))
        return guard, peak


def foam_block(client: int, center: FloatArray, half: float) -> int:
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[half] * 3, physicsClientId=client)
    body = p.createMultiBody(0, shape, -1, center.tolist(), physicsClientId=client)
    foam = FoamParameters()
    stiffness = {"contactStiffness": foam.stiffness, "contactDamping": foam.damping}
    p.changeDynamics(body, -1, **stiffness, physicsClientId=client)
    return int(body)


@pytest.mark.parametrize("gravity", [0.0, EARTH_GRAVITY], ids=["zero", "earth"])
@pytest.mark.parametrize("turn", [UPRIGHT, HANGING], ids=["upright", "hanging"])
@pytest.mark.parametrize("name", ["vx300s", "ur5e"])
def test_a_free_motion_is_no_touch(
    cell: CableCell, client: int, name: str, turn: tuple[float, float, float], gravity: float
) -> None:
    bench = Bench(cell, client, EVERY[name], turn, gravity)
    bench.place(bench.kin.robot.asleep)
    np.testing.assert_allclose(bench.arm.gravity(), [0.0, 0.0, -gravity])
    for goal in np.random.default_rng(3).uniform(-1.2, 1.2, (4, len(bench.kin))):
        goal = np.clip(goal, bench.kin.lower, bench.kin.upper)
        guard, _ = bench.follow(goal)
        assert guard.touch is None
        bench.step(48)
        assert bench.arm.reading().positions == pytest.approx(goal, abs=0.01)  # no drive was held too weak


@pytest.mark.parametrize("gravity", [0.0, EARTH_GRAVITY], ids=["zero", "earth"])
def test_an_arm_that_meets_foam_at_full_speed_stops_below_15_newtons_and_tells_where(
    cell: CableCell, client: int, gravity: float
) -> None:
    bench = Bench(cell, client, VX300S, UPRIGHT, gravity)
    start, goal = np.array([0.9, 0.2, 0.2, 0.0, 0.2, 0.0]), np.array([-0.9, 0.2, 0.2, 0.0, 0.2, 0.0])
    bench.place(start)
    half = 0.04
    center = bench.kin.tool(0.5 * (start + goal)).translation
    block = foam_block(client, center, half)
    guard, peak = bench.follow(goal, block)
    assert guard.touch is not None
    assert 0.0 < peak < 15.0
    model = CollisionModel(bench.kin, [])
    place, inward = contact_place(
        bench.kin,
        model.spheres(guard.touch.joints),
        model.links,
        guard.touch,
        model.clearances(guard.touch.joints),
    )
    outside = np.maximum(np.abs(place - center) - half, 0.0)
    assert np.linalg.norm(outside) < 0.05
    assert inward @ [0.0, -1.0, 0.0] > 0.7  # the arm swept that way


@pytest.mark.parametrize("gravity", [0.0, EARTH_GRAVITY], ids=["zero", "earth"])
def test_a_slow_arm_presses_a_wall_with_less_than_30_newtons(cell: CableCell, client: int, gravity: float) -> None:
    start, goal = np.array([0.3, 0.2, 0.2, 0.0, 0.2, 0.0]), np.array([-0.3, 0.2, 0.2, 0.0, 0.2, 0.0])
    peaks = []
    for limits in (FREE, replace(FREE, most=None)):
        bench = Bench(cell, client, VX300S, UPRIGHT, gravity)
        bench.place(start)
        shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.04] * 3, physicsClientId=client)
        center = bench.kin.tool(0.5 * (start + goal)).translation
        wall = p.createMultiBody(0, shape, -1, center.tolist(), physicsClientId=client)
        guard, peak = bench.follow(goal, wall, 0.05, limits)
        assert guard.touch is not None
        peaks.append(peak)
        p.removeBody(wall, physicsClientId=client)
        p.removeBody(bench.arm.body, physicsClientId=client)
    assert 0.0 < peaks[0] < 30.0
    assert peaks[0] < 0.6 * peaks[1]


def test_a_guard_that_presses_lets_through_what_a_free_one_does_not(cell: CableCell, client: int) -> None:
    touch = []
    for limits in (FREE, ContactGuardParameters().pressing):
        guard = ContactGuard(ArmDynamics(VX300S, RigidTransform.identity()), np.zeros(3), VX300S.chain.torques, limits)
        reading = arm_of(cell, client, VX300S, UPRIGHT)[0].reading()
        for n in range(10):
            pushed = np.zeros(6)
            pushed[0] = 3.0 if n > 4 else 0.0
            still = np.zeros(6)
            guard(type(reading)(n / 480, reading.positions, still, pushed))
        touch.append(guard.touch)
    assert touch[0] is not None
    assert touch[0].efforts[0] == pytest.approx(-3.0, abs=0.2)  # less what had become usual
    assert touch[1] is None


@pytest.mark.parametrize(
    ("near", "force", "touches"),
    [
        (True, [0.0, 0.0, 12.0], False),
        (True, [0.0, 0.0, -25.0], True),  # no cable pulls like that
        (False, [0.0, 0.0, -25.0], False),
        (True, [0.0, 12.0, 0.0], True),
    ],
)
def test_what_is_carried_may_pull_along_its_axis_but_not_push_across(
    near: bool, force: list[float], touches: bool
) -> None:
    dynamics = ArmDynamics(VX300S, RigidTransform.identity())
    q, still = np.array([0.2, 0.1, 0.3, 0.4, 0.5, 0.0]), np.zeros(6)
    limits = replace(ContactGuardParameters().carrying, pull=np.array([0.02, 0.0, 0.0, 0.0, 0.0, 1.0]))
    guard = ContactGuard(dynamics, np.zeros(3), VX300S.chain.torques, limits, lambda _: near)
    efforts = dynamics.efforts_of_pull(q, np.array([0.02, 0.0, 0.0, *force]))
    for n in range(4):
        guard(JointReading(n / 480, q, still, -efforts if n > 1 else still))
    assert (guard.touch is not None) == touches


def test_a_slow_push_that_turns_two_joints_a_little_is_felt(cell: CableCell, client: int) -> None:
    dynamics, torques = ArmDynamics(VX300S, RigidTransform.identity()), VX300S.chain.torques
    guard, seconds = ContactGuard(dynamics, np.zeros(3), torques, FREE), 0.4
    felt = 0.9 * FREE.share * torques * [0.0, 1.0, 1.0, 0.0, 0.0, 0.0]  # neither joint's reaches its limit
    for n in range(int(seconds * 480)):
        guard(JointReading(n / 480, np.zeros(6), np.zeros(6), felt * n / (seconds * 480)))
    assert guard.touch is not None


def test_what_a_cable_pulls_is_no_part_of_a_touch() -> None:
    dynamics = ArmDynamics(VX300S, RigidTransform.identity())
    q, still = np.array([0.2, 0.1, 0.3, 0.4, 0.5, 0.0]), np.zeros(6)
    limits = replace(ContactGuardParameters().pulling, pull=np.array([0.02, 0.0, 0.0, 0.0, 0.0, 1.0]))
    guard = ContactGuard(dynamics, np.zeros(3), VX300S.chain.torques, limits, lambda _: True)
    touch = 0.5 * VX300S.chain.torques * [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]  # the pull does not turn the forearm
    pulled = dynamics.efforts_of_pull(q, np.array([0.02, 0.0, 0.0, 0.0, 0.0, 12.0]))
    for n in range(4):
        guard(JointReading(n / 480, q, still, -(pulled + touch) if n > 1 else still))
    assert guard.touch is not None
    np.testing.assert_allclose(guard.touch.efforts, touch, atol=0.1)


@pytest.mark.parametrize("near", [True, False])
def test_what_is_carried_may_pull_harder_where_nothing_is_near(near: bool) -> None:
    dynamics = ArmDynamics(VX300S, RigidTransform.identity())
    limits, torques = ContactGuardParameters().carrying, VX300S.chain.torques
    assert limits.far is not None
    felt = []
    for share in (0.5 * (limits.share + limits.far), 1.5 * limits.far):
        guard = ContactGuard(dynamics, np.zeros(3), torques, limits, lambda _: near)
        for n in range(4):
            pushed = share * torques * np.eye(6)[0] * (n > 1)
            guard(JointReading(n / 480, np.zeros(6), np.zeros(6), pushed))
        felt.append(guard.touch is not None)
    assert felt == [near, True]
