"""Sliding fingers whose joints and links stand otherwise than the ViperX's: the Panda's, and one of a toy."""

from pathlib import Path

import numpy as np
import pybullet as p
import pytest
from jaws import THICKNESS, check_gaps, check_hold, lone_arm, pads_apart
from robots import PANDA, VX300S
from scipy.spatial.transform import Rotation
from toy_robot import ROBOT, URDF, write_robot

from regrasp.app.files.findings import Findings
from regrasp.app.robots.robot_file import load_robot
from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.robot.robot import Robot
from regrasp.interfaces.robot.urdf import pose_of, rpy_of

MASS = 0.1  # kg
LEFT = '<axis xyz="0 1 0"/><limit lower="0" upper="0.05"'
RIGHT = '<axis xyz="0 1 0"/><limit lower="-0.05" upper="0"'
TOYS = {  # what stands in place of LEFT and RIGHT, and of the fingers' origins; the signs
    "opposite positions": (LEFT, RIGHT, 0.0, (1.0, -1.0)),
    "opposite axes": (LEFT, '<axis xyz="0 -1 0"/><limit lower="0" upper="0.05"', 0.0, (1.0, 1.0)),
    "both open downwards": ('<axis xyz="0 -1 0"/><limit lower="-0.05" upper="0"', RIGHT, 0.0, (-1.0, -1.0)),
    "origins off the middle": (LEFT, RIGHT, 0.004, (1.0, -1.0)),
}


def toy(folder: Path, kind: str) -> Robot:
    left, right, off, _ = TOYS[kind]
    path, (before, after) = write_robot(folder), URDF.split('<joint name="right"')
    parts = [before.replace(LEFT, left), after.replace(RIGHT, right)]
    for i, side in enumerate((1, -1)):
        head, joint = parts[i].rsplit('<origin xyz="0 0 0.22"/>', 1)
        parts[i] = f'{head}<origin xyz="0 {side * off} 0.22"/>{joint}'
    (folder / "toy.urdf").write_text('<joint name="right"'.join(parts))
    return load_robot(path)


@pytest.mark.parametrize("gap", [0.0, 0.01, 0.04, 0.07])
def test_the_pandas_pads_stand_as_far_apart_as_its_jaw_is_open(cell: CableCell, client: int, gap: float) -> None:
    arm = lone_arm(cell, client, PANDA, PANDA.sleep)
    arm.gripper.place_at(gap)
    assert arm.gripper.true_gap() == pytest.approx(gap, abs=1e-6)
    assert pads_apart(arm) == pytest.approx(gap, abs=1e-4)
    tool = arm.tool_pose().inv()
    states = p.getLinkStates(arm.body, arm.gripper.pads, 0, 1, physicsClientId=client)
    pads = np.array([tool.apply(state[4]) for state in states])
    np.testing.assert_allclose(pads, [(0.0, side * (gap + 0.004) / 2, 0.0) for side in (1, -1)], atol=1e-4)


def test_the_panda_opens_to_a_gap_and_reads_what_it_is(cell: CableCell, client: int) -> None:
    arm = lone_arm(cell, client, PANDA, PANDA.sleep)
    check_gaps(arm, (0.07, 0.04, 0.01))


@pytest.mark.parametrize("force", [10.0, 20.0])  # N of each finger
def test_the_panda_presses_with_the_force_that_it_is_told_and_holds_a_block_by_friction(
    cell: CableCell, client: int, force: float
) -> None:
    arm = lone_arm(cell, client, PANDA, PANDA.sleep)
    solid = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.01, THICKNESS / 2, 0.02], physicsClientId=client)
    check_hold(arm, solid, MASS, force, opening=0.06)


@pytest.mark.parametrize("kind", TOYS)
def test_which_way_a_finger_opens_follows_from_the_urdf(
    cell: CableCell, client: int, kind: str, tmp_path: Path
) -> None:
    robot = toy(tmp_path, kind)
    assert robot.parallel_jaw.signs == TOYS[kind][3]
    arm = lone_arm(cell, client, robot, robot.sleep)
    for gap in (0.01, 0.04):
        arm.gripper.place_at(gap)
        assert arm.gripper.true_gap() == pytest.approx(gap, abs=1e-6)
        assert pads_apart(arm) == pytest.approx(gap, abs=1e-4)
    moved = robot.body.at(0.02)[-2:, 1] - robot.body.at(0.03)[-2:, 1]  # spheres of both fingers
    np.testing.assert_allclose(moved, [-0.005, 0.005], atol=1e-9)


def test_the_vipers_fingers_are_where_they_were() -> None:
    assert VX300S.gripper_positions(0.033) == {"left_finger": 0.036, "right_finger": -0.036}
    jaw = VX300S.parallel_jaw
    for pose, y in zip(jaw.pads, (-0.0165, 0.0165), strict=True):
        assert np.array_equal(pose, pose_of((0.0565, y, 0.0), (0.0, 0.0, 0.0)))


WRONG = {
    "no such joint": ("joints: [left, right]", "joints: [lefd, right]", "'lefd' is not in the URDF; did you mean 'lef"),
    "a joint that turns": ("joints: [left, right]", "joints: [left, bend]", "'bend' is revolute, not prismatic; there"),
    "one joint twice": ("joints: [left, right]", "joints: [left, left]", "both fingers are 'left'; name two joints"),
    "pads on no link": ("links: [left, right]", "links: [lefd, right]", "no link 'lefd'; did you mean 'left'?"),
    "pads exchanged": ("links: [left, right]", "links: [right, left]", "the joint left does not move right; name left"),
    "no such show": ("  friction: 0.8", "  friction: 0.8\n  spin: [prop]", "the URDF has no joint 'prop'"),
    "too wide": (
        "opening: 0.04",
        "opening: 0.09",
        "left would stand at 0.054 m with the pads 0.09 m apart",
    ),
    "too close": ("face: 0.005", "face: -0.006", "left would stand at -0.002 m with the pads 0 m apart"),
    "a tool across": (
        "rpy: [0.0, -1.5707963267948966, 0.0]",
        "rpy: [0.0, 0.0, 1.57]",
        "the tool's x lies along the way in which",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_gripper_that_the_urdf_does_not_have_is_a_line(case: str, tmp_path: Path) -> None:
    right, wrong, words = WRONG[case]
    assert ROBOT.count(right) == 1, right
    with pytest.raises(Findings) as error:
        load_robot(write_robot(tmp_path, ROBOT.replace(right, wrong)))
    (found,) = error.value.items
    assert words in found.message
    assert found.line > 1


@pytest.mark.parametrize("rpy", [(0.3, -0.4, 2.0), (0.5, np.pi / 2, 0.0), (-0.2, -np.pi / 2, 1.0), (np.pi, 0.0, 0.0)])
def test_roll_pitch_and_yaw_make_their_rotation_again(rpy: tuple[float, float, float]) -> None:
    turn = pose_of((0.0, 0.0, 0.0), rpy)[:3, :3]
    again = Rotation.from_euler("xyz", rpy_of(turn)).as_matrix()
    np.testing.assert_allclose(again, turn, atol=1e-9)
