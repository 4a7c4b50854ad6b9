from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import robots
from hypothesis import assume, example, given
from hypothesis import strategies as st
from pydantic import ValidationError

from regrasp.interfaces.cable.cell import CableCell, Socket
from regrasp.interfaces.cell import FixedMount, WristMount, pose_along
from regrasp.interfaces.tag import Tag

LENGTH = 1e-9  # metres
coordinates = st.floats(-2.0, 2.0)
vectors = st.tuples(coordinates, coordinates, coordinates)


@pytest.fixture
def data() -> Any:
    return robots.thesis()


@pytest.fixture
def thesis(data: Any) -> CableCell:
    return CableCell.model_validate(data)


@given(position=vectors, axis=vectors)
def test_pose_along_points_x_and_keeps_z_up(
    position: tuple[float, float, float], axis: tuple[float, float, float]
) -> None:
    assume(np.linalg.norm(axis) > 1e-3)
    pose = pose_along(position, axis)
    x, y, z = pose.rotation.as_matrix().T
    np.testing.assert_allclose(x, np.asarray(axis) / np.linalg.norm(axis), atol=1e-9)
    np.testing.assert_allclose(pose.translation, position)
    if abs(x[2]) < 0.99:
        assert z[2] > 0
        assert abs(y[2]) < 1e-9


def test_a_plug_sits_its_depth_in_the_mouth(thesis: CableCell) -> None:
    for socket in thesis.known.cable.sockets:
        plug = socket.world_from_plug(thesis.known.cable.connector.length)
        tip = plug.apply([thesis.known.cable.connector.length / 2, 0.0, 0.0])
        axis = np.asarray(socket.axis) / np.linalg.norm(socket.axis)
        mouth = np.asarray(socket.center) - axis * socket.size[1] / 2
        np.testing.assert_allclose(tip, mouth + socket.depth * axis, atol=LENGTH)


def test_an_upright_box_just_holds_a_tilted_block() -> None:
    angle = np.deg2rad(25.0)
    axis = (0.0, float(np.cos(angle)), float(np.sin(angle)))
    socket = Socket(name="s", center=(0, 0, 0), size=(0.04, 0.06, 0.08), axis=axis, depth=0.01, pull_out_force=10.0)
    turn = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    corners = np.array([[x, y, z] for x in (-0.02, 0.02) for y in (-0.03, 0.03) for z in (-0.04, 0.04)])
    np.testing.assert_allclose(socket.upright_box().size, 2 * (corners @ turn.T).max(axis=0), atol=LENGTH)


_part = st.floats(-1.0, 1.0)


@given(axis=st.tuples(_part, _part, _part).filter(lambda axis: np.linalg.norm(axis) > 1e-3))
@example(axis=(1.0, 0.0, 0.0))
@example(axis=(0.0, 0.0, -1.0))
def test_a_block_is_turned_so_that_its_y_edge_lies_on_the_plug_axis(axis: tuple[float, float, float]) -> None:
    socket = Socket(name="s", center=(0, 0, 0), size=(0.04, 10.0, 0.08), axis=axis, depth=0.01, pull_out_force=10.0)
    unit = np.asarray(axis) / np.linalg.norm(axis)
    matrix = socket.world_from_block.as_matrix()
    assert abs(float(matrix[:, 1] @ unit)) == pytest.approx(1.0)
    assert matrix[2, 0] == pytest.approx(0.0, abs=LENGTH)  # the x edge is level
    assert np.all(np.asarray(socket.upright_box().size) > np.abs(unit) * socket.size[1] - LENGTH)


def test_a_fixed_camera_looks_forward_and_down() -> None:
    pose = FixedMount(position=(0.0, 0.0, 0.4), pitch_down_deg=30.0).world_from_camera
    right, down, forward = pose.rotation.as_matrix().T
    np.testing.assert_allclose(forward, [np.cos(np.pi / 6), 0.0, -0.5], atol=1e-9)
    np.testing.assert_allclose(right, [0.0, -1.0, 0.0], atol=1e-9)
    assert down[2] < 0


def test_a_camera_turned_by_yaw_looks_left() -> None:
    pose = FixedMount(position=(0.0, 0.0, 0.0), pitch_down_deg=0.0, yaw_deg=90.0).world_from_camera
    np.testing.assert_allclose(pose.rotation.apply([0, 0, 1]), [0.0, 1.0, 0.0], atol=1e-9)


def test_a_wrist_camera_looks_along_the_mounts_x() -> None:
    mount = WristMount(arm="left", offset=(0.02, 0.0, 0.06)).mount_from_camera
    np.testing.assert_allclose(mount.apply([0.0, 0.0, 1.0]), [1.02, 0.0, 0.06], atol=1e-9)


def test_the_thesis_cell_finds_its_parts(thesis: CableCell) -> None:
    known = thesis.known
    assert known.cable.socket(known.cable.plugged_into).name == "back_4"
    assert known.arm("left").base[1] == 0.1778
    assert known.camera("wrist").intrinsics.width == 848
    assert {"floor", "back_panel", "clip_rod", "right_1"} <= {box.name for box in known.solids()}


def test_an_unknown_socket_lists_those_that_exist(thesis: CableCell) -> None:
    with pytest.raises(KeyError, match=r"no socket 'back_9'; there are back_1, back_2"):
        thesis.known.cable.socket("back_9")


def _misspell(data: Any) -> None:
    data["known"]["cable"]["connector"]["colour"] = [0, 0, 0]


def _no_direction(data: Any) -> None:
    data["hidden"]["cable"]["anchor_axis"] = [0.0, 0.0, 0.0]


def _too_many_links(data: Any) -> None:
    data["hidden"]["cable"]["links"] = 31


def _not_finite(data: Any) -> None:
    data["hidden"]["cable"]["connector_mass"] = float("inf")


def _odd_rate(data: Any) -> None:
    data["hidden"]["step_rate"] = 500


def _upside_down(data: Any) -> None:
    data["known"]["mapped"] = {"lower": [0, 0, 0.5], "upper": [1, 1, 0.2]}


def _too_many_voxels(data: Any) -> None:
    data["known"]["mapped"] = {"lower": [0, 0, 0], "upper": [2, 3, 2]}


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (_too_many_voxels, "12 million voxels, at most 3 million are allowed; .* add voxel: 0.016"),
        (_upside_down, "lower is not below upper"),
        (_misspell, "Extra inputs"),
        (_no_direction, "a direction must not be zero"),
        (_too_many_links, "less than or equal to 30"),
        (_not_finite, "less than or equal to 100"),
        (_odd_rate, "multiple of 240"),
    ],
)
def test_a_wrong_cell_is_refused(data: Any, spoil: Callable[[Any], None], message: str) -> None:
    spoil(data)
    with pytest.raises(ValidationError, match=message):
        CableCell.model_validate(data)


def test_values_do_not_change(thesis: CableCell) -> None:
    with pytest.raises(ValidationError, match="frozen"):
        thesis.known.cable.plugged_into = "back_1"


def test_a_tag_faces_the_bodys_left_with_its_x_along_the_bodys() -> None:
    tag = Tag(number=3, size=0.03, plate=0.04, center=(0.1, 0.02, 0.3))
    np.testing.assert_allclose(tag.body_from_tag.translation, tag.center)
    np.testing.assert_allclose(tag.body_from_tag.rotation.apply(np.eye(3)), [[1, 0, 0], [0, 0, -1], [0, 1, 0]])
