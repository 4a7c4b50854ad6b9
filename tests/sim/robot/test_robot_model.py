import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pybullet as p
import pytest
from robots import VX300S
from scipy.spatial.transform import RigidTransform

from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.perception.mapping.occupancy import OccupancyParameters
from regrasp.sim.robot.model import CAMERA_SIZE, robot_urdf

GRAY = (0.30, 0.30, 0.31)
OFFSET = (0.02, 0.0, 0.06)  # m
# The links that the joints move.
JOINT_LINKS = [
    f"{part}_link" for part in ("shoulder", "upper_arm", "upper_forearm", "lower_forearm", "wrist", "gripper")
]
NEAR = 5e-4  # m: motion's kinematics against the URDF's


@pytest.fixture(scope="module")
def urdf() -> str:
    return robot_urdf(VX300S, OFFSET)


@pytest.fixture
def robot(urdf: str, tmp_path: Path) -> Iterator[tuple[int, int, dict[str, int]]]:
    """Client, body and links by name."""
    client = p.connect(p.DIRECT)
    path = tmp_path / "robot.urdf"
    path.write_text(urdf, encoding="utf-8")
    body = p.loadURDF(str(path), useFixedBase=True, physicsClientId=client)
    infos = [p.getJointInfo(body, j, physicsClientId=client) for j in range(p.getNumJoints(body, client))]
    yield client, body, {info[12].decode().removeprefix("vx300s/"): info[0] for info in infos}
    p.disconnect(client)


@pytest.mark.parametrize("gap", [0.005, 0.03, 0.075])
def test_the_pads_collision_shapes_stand_the_gap_apart(robot: tuple[int, int, dict[str, int]], gap: float) -> None:
    client, body, links = robot
    for finger, position in VX300S.gripper_positions(gap).items():
        p.resetJointState(body, links[f"{finger}_link"], position, physicsClientId=client)
    point = p.getClosestPoints(body, body, 0.1, links["left_pad"], links["right_pad"], physicsClientId=client)
    assert point[0][8] == pytest.approx(gap, abs=1e-4)


def test_the_tool_is_where_the_motion_room_believes(robot: tuple[int, int, dict[str, int]]) -> None:
    client, body, links = robot
    q = np.array([0.4, -0.5, 0.6, 0.3, 0.5, -0.7])
    for name, value in zip(JOINT_LINKS, VX300S.signs * q, strict=True):
        p.resetJointState(body, links[name], value, physicsClientId=client)
    pads = [p.getLinkState(body, links[f"{s}_pad"], 0, 1, physicsClientId=client)[4] for s in ("left", "right")]
    expected = ArmKinematics(VX300S, RigidTransform.identity()).tool(q).translation
    np.testing.assert_allclose(np.mean(pads, axis=0), expected, atol=NEAR)


def test_the_camera_is_carried_by_a_bracket_that_nothing_can_touch(urdf: str) -> None:
    link = next(e for e in ET.fromstring(urdf).iter("link") if e.get("name") == "camera_body")
    body, bracket = link.findall("visual")
    (collision,) = link.findall("collision")
    assert _size(body) == _size(collision) == list(CAMERA_SIZE)
    origin = bracket.find("origin")
    assert origin is not None
    # z points down in the URDF's wrist link: the bracket reaches from the camera to the wrist's axis.
    middle = float(origin.get("xyz", "").split()[2])
    assert middle - _size(bracket)[2] / 2 == pytest.approx(0.0)
    assert middle + _size(bracket)[2] / 2 == pytest.approx(OFFSET[2])


def test_an_arm_without_a_camera_has_no_camera_body() -> None:
    assert "camera_body" not in robot_urdf(VX300S, None)


def test_the_arms_are_dark_grey_and_lighter_than_the_cable(robot: tuple[int, int, dict[str, int]]) -> None:
    client, body, _ = robot
    colors = [shape[7][:3] for shape in p.getVisualShapeData(body, physicsClientId=client)]
    arms = [c for c in colors if c == pytest.approx(GRAY)]
    assert len(arms) >= 12
    assert max(GRAY) < 0.5
    assert 255 * min(GRAY) > OccupancyParameters().max_cable_brightness


def _size(shape: ET.Element) -> list[float]:
    box = shape.find("geometry/box")
    assert box is not None
    return [float(v) for v in box.get("size", "").split()]
