"""What holds for every robot: a ViperX, a UR5e alone and on a rail, and a Panda with its seven joints.

All hang from above, turned.
"""

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from robots import EVERY
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import WristMount
from regrasp.interfaces.robot.chain import Chain
from regrasp.motion.robots.answers import wrap
from regrasp.motion.robots.ik_parameters import InverseKinematicsParameters
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.robots.views import ik_view

LIMITS = InverseKinematicsParameters()
BASE = RigidTransform.from_components([0.3, -0.2, 1.4], Rotation.from_euler("xyz", [170, -20, 35], degrees=True))
KINS = {name: ArmKinematics(robot, BASE) for name, robot in EVERY.items()}
UR5E, ON_RAIL, PANDA = (KINS[name] for name in ("ur5e", "ur5e_on_rail", "panda"))
MOUNT = WristMount(arm="any", offset=(0.02, 0.01, 0.06)).mount_from_camera
BRANCHES = 8  # of six joints
EVERY_KIN = pytest.mark.parametrize("kin", KINS.values(), ids=KINS.keys())
CLOSED = pytest.mark.parametrize("kin", [KINS["vx300s"], UR5E], ids=["vx300s", "ur5e"])
BY_HAND = pytest.mark.parametrize("kin", [UR5E, ON_RAIL], ids=["ur5e", "ur5e_on_rail"])  # the camera is on the hand


def drawn(kin: ArmKinematics, count: int, seed: int = 0) -> FloatArray:
    """Joints (count, n) within the limits."""
    return np.random.default_rng(seed).uniform(kin.lower, kin.upper, (count, len(kin)))


def error(kin: ArmKinematics, q: FloatArray, world_from_tool: FloatArray) -> tuple[float, float]:
    """By how much, m and rad, the joints miss a pose of the tool (4, 4)."""
    pose = kin.tool_matrix(q)
    turn = Rotation.from_matrix(pose[:3, :3]).inv() * Rotation.from_matrix(world_from_tool[:3, :3])
    return float(np.linalg.norm(pose[:3, 3] - world_from_tool[:3, 3])), float(turn.magnitude())


def check(kin: ArmKinematics, answers: FloatArray, world_from_tool: FloatArray) -> None:
    """Every answer reaches the pose and keeps the limits."""
    for q in answers:
        distance, turn = error(kin, q, world_from_tool)
        assert distance < LIMITS.position
        assert turn < LIMITS.angle
        assert np.all((q >= kin.lower) & (q <= kin.upper))


def off(answers: FloatArray, q: FloatArray) -> float:
    """By how much, whole turns aside, the answer (k, n) differs from joints (n,) that is nearest to them."""
    return float(np.abs(wrap(answers - q)).max(axis=1).min(initial=np.inf))


def singular(kin: ArmKinematics, q: FloatArray) -> float:
    """How near joints are to a place from which the tool cannot move every way: 0 there."""
    return float(np.linalg.svd(kin.jacobian(q), compute_uv=False)[-1])


@EVERY_KIN
def test_links_are_where_the_urdf_s_joints_put_them(kin: ArmKinematics) -> None:
    robot, jaw = kin.robot, kin.robot.gripper_positions(0.02)
    root_from_base = robot.tree.frame(robot.base_link)
    places = {link: robot.link_place(link, 0.02) for link in robot.tree.links}
    for q in drawn(kin, 100):
        positions = dict(zip(robot.urdf_joints, robot.signs * q, strict=True)) | jaw
        frames = kin.link_frames(q)
        for link, (index, link_from_part) in places.items():
            expected = kin.base @ np.linalg.inv(root_from_base) @ robot.tree.frame(link, positions)
            np.testing.assert_allclose(frames[index] @ link_from_part, expected, atol=1e-9)


@pytest.mark.parametrize("name", ["vx300s", "ur5e", "ur5e_on_rail"])
def test_every_pose_within_reach_is_solved_and_every_answer_right(name: str) -> None:
    kin = KINS[name]
    assert kin.closed_form
    for q in drawn(kin, 300):
        pose = kin.tool_matrix(q)
        answers = kin.ik(pose)
        assert len(answers)
        check(kin, answers[:16], pose)


@pytest.mark.parametrize(
    "kin",
    [
        pytest.param(KINS["vx300s"], id="vx300s"),
        pytest.param(UR5E, id="ur5e"),
    ],
)
def test_joints_at_right_angles_are_solved(kin: ArmKinematics) -> None:
    """Arms stretched and folded, wrists straight: poses that a person picks, and that have no end of solutions."""
    rng, missed = np.random.default_rng(7), []
    for _ in range(150):
        q = np.clip(0.5 * np.pi * rng.integers(-2, 3, len(kin)), kin.lower, kin.upper)
        pose = kin.tool_matrix(q)
        answers = kin.ik(pose)
        check(kin, answers, pose)
        if not len(answers):
            missed.append(q)
    assert missed == []


def test_the_seven_joints_reach_nearly_every_pose_and_every_answer_is_right() -> None:
    assert not PANDA.closed_form
    solved, count = 0, 24
    for q in drawn(PANDA, count):
        pose = PANDA.tool_matrix(q)
        answers = PANDA.ik(pose)
        solved += bool(len(answers))
        check(PANDA, answers, pose)
    assert solved >= count - 1


@pytest.mark.parametrize("name", ["vx300s", "ur5e", "ur5e_on_rail", "panda"])
def test_a_search_near_the_joints_of_a_pose_finds_them(name: str) -> None:
    kin = KINS[name]
    for q in drawn(kin, 300 if kin.closed_form else 5, seed=1):
        answers = kin.ik(kin.tool_matrix(q), near=q)
        assert float(np.abs(answers - q).max(axis=1).min()) < 2 * LIMITS.distinct  # two answers so near are one


@CLOSED
def test_all_branches_are_answered(kin: ArmKinematics) -> None:
    for q in drawn(kin, 300, seed=2):
        answers = kin.solve(kin.tool_matrix(q))
        assert 1 <= len(answers) <= BRANCHES
        assert off(answers, q) < 2 * LIMITS.distinct


@pytest.mark.parametrize("name", ["vx300s", "ur5e"])
def test_a_search_from_everywhere_finds_no_further_branch(name: str) -> None:
    kin, poses = KINS[name], 0
    for q in drawn(kin, 10, seed=3):
        pose = kin.tool_matrix(q)
        answers = kin.solve(pose)
        found = searched(kin.chain, np.linalg.inv(kin.base) @ tip_of(kin, pose), np.random.default_rng(0), 200)
        for other in found:
            assert off(answers, other) < 2 * LIMITS.distinct, (answers, other)
        poses += len(found) == len(answers)
    assert poses >= 8  # else the search itself is too weak to say anything


@given(st.integers(0, 2**32 - 1))
def test_a_joint_that_turns_more_than_once_round_comes_back_nearest_to_where_it_was(seed: int) -> None:
    q, near = drawn(UR5E, 2, seed)
    more = np.flatnonzero(UR5E.upper - UR5E.lower > 2 * np.pi + 1e-9)
    assert len(more) == 5  # all but the elbow
    for answer in UR5E.ik(UR5E.tool_matrix(q), near):
        for turn in (-2 * np.pi, 2 * np.pi):
            other = answer[more] + turn
            allowed = (other >= UR5E.lower[more]) & (other <= UR5E.upper[more])
            nearer = np.abs(other - near[more]) < np.abs(answer[more] - near[more]) - 1e-9
            assert not np.any(allowed & nearer)


@example(1696, 0.0)
@example(148353, 0.0)
@given(st.integers(0, 2**32 - 1), st.floats(-1.0, 2.0))
def test_a_rail_stays_where_it_is_if_the_arm_reaches(seed: int, rail: float) -> None:
    q = drawn(ON_RAIL, 1, seed)[0]
    q[0] = rail
    answers = ON_RAIL.ik(ON_RAIL.tool_matrix(q), near=q)
    assert len(answers)
    assert np.all(answers[:, 0] == rail)


def test_a_rail_moves_where_the_arm_alone_does_not_reach() -> None:
    for q in drawn(ON_RAIL, 40, seed=4):
        q[0] = 1.9
        pose = ON_RAIL.tool_matrix(q)
        asleep = np.array(EVERY["ur5e_on_rail"].sleep)
        asleep[0] = -0.9  # 2.8 m off, and the arm is 1.2 m long
        answers = ON_RAIL.ik(pose, near=asleep)
        assert len(answers)
        check(ON_RAIL, answers, pose)


def test_a_pose_beyond_the_rails_end_has_no_answer() -> None:
    pose = ON_RAIL.tool_matrix(drawn(ON_RAIL, 1)[0])
    pose[:3, 3] = BASE.apply([0.0, 4.0, 0.2])
    assert ON_RAIL.ik(pose).shape == (0, 7)


@EVERY_KIN
def test_the_jacobian_is_how_the_tool_moves(kin: ArmKinematics) -> None:
    step = 1e-6
    for q in drawn(kin, 30, seed=5):
        for joint, moved in enumerate(step * np.eye(len(kin))):
            before, after = kin.tool(q - moved), kin.tool(q + moved)
            turn = (after.rotation * before.rotation.inv()).as_rotvec()
            way = np.concatenate([after.translation - before.translation, turn]) / (2 * step)
            np.testing.assert_allclose(kin.jacobian(q)[:, joint], way, atol=1e-8)


@BY_HAND
def test_a_camera_on_the_hand_looks_from_the_place_asked_for_and_upright_first(kin: ArmKinematics) -> None:
    for q in drawn(kin, 20, seed=6):
        wanted = kin.mount(q) * MOUNT
        answers = ik_view(kin, wanted, MOUNT)
        ups = []
        for answer in answers:
            camera = kin.mount(answer) * MOUNT
            seen, asked = camera.rotation.as_matrix(), wanted.rotation.as_matrix()
            assert float(np.linalg.norm(camera.translation - wanted.translation)) < 1e-3
            assert float(seen[:, 2] @ asked[:, 2]) > np.cos(LIMITS.camera_axis)
            assert np.all((answer >= kin.lower) & (answer <= kin.upper))
            ups.append(float(seen[:, 1] @ asked[:, 1]))
        assert ups[0] > 1 - 1e-5
        assert np.all(np.diff(ups) < 2 * LIMITS.angle)


def tip_of(kin: ArmKinematics, world_from_tool: FloatArray) -> FloatArray:
    """The pose (4, 4) at the tool's place that is parallel to the last link."""
    tip = world_from_tool.copy()
    tip[:3, :3] = tip[:3, :3] @ kin.last_from_tool[:3, :3].T
    return tip


def searched(chain: Chain, base_from_tip: FloatArray, rng: np.random.Generator, starts: int) -> list[FloatArray]:
    """Different joints that bring the tip to the pose (4, 4), by damped Newton steps from random starts.

    It shares no code with what it checks.
    """
    q = rng.uniform(-np.pi, np.pi, (starts, len(chain)))
    target = Rotation.from_matrix(base_from_tip[:3, :3])
    damping = np.full(starts, 0.1)
    place, turn, jacobian = _chain_at(chain, q)
    miss = np.hstack([base_from_tip[:3, 3] - place, (target * turn.inv()).as_rotvec()])
    for _ in range(150):
        square = jacobian.transpose(0, 2, 1) @ jacobian + damping[:, None, None] * np.eye(len(chain))
        step = np.linalg.solve(square, jacobian.transpose(0, 2, 1) @ miss[:, :, None])[:, :, 0]
        place, turn, moved = _chain_at(chain, q + step)
        left = np.hstack([base_from_tip[:3, 3] - place, (target * turn.inv()).as_rotvec()])
        better = np.linalg.norm(left, axis=1) < np.linalg.norm(miss, axis=1)
        q[better] += step[better]
        miss[better], jacobian[better] = left[better], moved[better]
        damping *= np.where(better, 0.3, 3.0)
        damping = np.clip(damping, 1e-12, 1e3)
    return list(_different(wrap(q[np.linalg.norm(miss, axis=1) < 1e-9])))


def _different(rows: FloatArray) -> Iterator[FloatArray]:
    kept: list[FloatArray] = []
    for row in rows:
        if not kept or off(np.array(kept), row) > 1e-4:
            kept.append(row)
            yield row


def _chain_at(chain: Chain, q: FloatArray) -> tuple[FloatArray, Rotation, FloatArray]:
    """Place (m, 3) and turn of the tip, and the Jacobians (m, 6, n), at joints (m, n) that all turn."""
    turn, place = Rotation.identity(len(q)), np.zeros((len(q), 3))
    places, axes = [], []
    for i, axis in enumerate(chain.axes):
        place = place + turn.apply(chain.origins[i])
        places.append(place)
        axes.append(turn.apply(axis))
        turn = turn * Rotation.from_rotvec(q[:, i, None] * axis)
    place = place + turn.apply(chain.last_from_tool[:3, 3])
    columns = [np.hstack([np.cross(axis, place - at), axis]) for axis, at in zip(axes, places, strict=True)]
    return place, turn, np.stack(columns, axis=2)


@EVERY_KIN
@pytest.mark.parametrize(
    "count", [12, 100, pytest.param(300, marks=pytest.mark.slow)]
)  # the closed form shares 100 poses between threads
def test_many_poses_have_the_answers_of_each(kin: ArmKinematics, count: int) -> None:
    if not kin.closed_form:
        count //= 12  # each takes a quarter of a second, and they share nothing
    straight = np.zeros(len(kin))
    near = drawn(kin, 1, seed=3)[0]
    poses = [kin.tool_matrix(q) for q in (*drawn(kin, count), straight)]
    poses.insert(5, RigidTransform.from_translation([30.0, 0.0, 0.0]).as_matrix() @ poses[0])
    one_by_one = np.concatenate([kin.ik(pose, near) for pose in poses])
    np.testing.assert_array_equal(kin.ik_of_all(np.array(poses), near), one_by_one)
    assert kin.ik_of_all(np.empty((0, 4, 4))).shape == (0, len(kin))
