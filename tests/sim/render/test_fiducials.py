"""Tags and checkerboards of boxes, as a detector sees them."""

from collections.abc import Iterator

import cv2
import numpy as np
import pybullet as p
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.frame import Intrinsics
from regrasp.interfaces.tag import TAG_DICTIONARY, Tag
from regrasp.sim.cameras.board import board_pictures, board_poses
from regrasp.sim.render.fiducials import MAX_PARTS, compound_visual, tag_boxes
from regrasp.sim.render.picture import LightState
from regrasp.sim.render.renderer import make_renderer
from regrasp.sim.render.visuals import Visuals

K = Intrinsics.from_fov(424, 240, float(np.deg2rad(30.0)))
LIGHT = LightState((0.3, -0.5, -1.0), 0.45, 0.55)
FACING = RigidTransform.from_components([0.0, 0.0, 0.5], Rotation.from_euler("x", np.pi))


@pytest.fixture
def client() -> Iterator[int]:
    number = p.connect(p.DIRECT)
    yield number
    p.disconnect(number)


def tag_of(number: int) -> Tag:
    return Tag(number=number, size=0.032, plate=0.04, center=(0.0, 0.0, 0.0))


@pytest.mark.parametrize("number", [0, 7, 17, 23, 49])
def test_a_tag_is_read_with_its_number_where_it_is(client: int, number: int) -> None:
    p.createMultiBody(0, -1, compound_visual(client, tag_boxes(tag_of(number)), FACING), physicsClientId=client)
    visuals = Visuals(client)
    drawer = make_renderer(visuals)
    rgb = drawer.render(visuals.snapshot(), RigidTransform.identity(), K, LIGHT).rgb
    drawer.close()
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, TAG_DICTIONARY))
    corners, numbers, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY))
    assert numbers.ravel().tolist() == [number]
    half = 0.016 * K.fx / 0.5
    square = half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) + np.array([K.cx, K.cy])
    np.testing.assert_allclose(corners[0][0], square, atol=1.5)


@pytest.mark.parametrize("number", range(50))
def test_every_tag_fits_into_one_shape_beside_the_cylinder(number: int) -> None:
    boxes = tag_boxes(tag_of(number))
    assert len(boxes) < MAX_PARTS
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, TAG_DICTIONARY))
    white = cv2.aruco.generateImageMarker(dictionary, number, 6) > 0
    area = sum(box.size[0] * box.size[1] for box in boxes[2:])
    assert area == pytest.approx(white.sum() * (0.032 / 6) ** 2)


def test_a_shape_keeps_its_cylinder_and_colours(client: int) -> None:
    shape = compound_visual(client, tag_boxes(tag_of(7)), RigidTransform.identity(), (0.01, 0.09, (0.75, 0.05, 0.06)))
    p.createMultiBody(0, -1, shape, physicsClientId=client)
    first, second, *_ = Visuals(client).items
    assert (first.kind, first.size[:2]) == (p.GEOM_CYLINDER, (0.09, 0.01))
    np.testing.assert_allclose(first.color, (0.75, 0.05, 0.06), atol=1e-6)
    np.testing.assert_allclose(first.link_from_visual.rotation.apply([0.0, 0.0, 1.0]), [1.0, 0.0, 0.0], atol=1e-6)
    assert (second.kind, second.size[:2]) == (p.GEOM_BOX, (0.04, 0.04))


def test_boards_are_whole_in_the_picture_tilted_and_the_same_for_a_seed() -> None:
    poses, again = (board_poses(K, 9, 6, 0.025, 30, np.random.default_rng(3)) for _ in range(2))
    tilts = []
    for pose, same in zip(poses, again, strict=True):
        np.testing.assert_array_equal(pose.as_matrix(), same.as_matrix())
        corners = pose.apply([[x * 0.15, y * 0.1125, 0.0] for x in (-1, 1) for y in (-1, 1)])
        u, v = (corners[:, :2] / corners[:, 2:] * [K.fx, K.fy] + [K.cx, K.cy]).T
        assert u.min() > 0
        assert v.min() > 0
        assert u.max() < K.width - 1
        assert v.max() < K.height - 1
        tilts.append(-pose.rotation.apply([0.0, 0.0, 1.0])[2])
    assert np.degrees(np.arccos(np.min(tilts))) > 30.0


def test_both_renderers_draw_the_same_board() -> None:
    poses = board_poses(K, 5, 4, 0.025, 2, np.random.default_rng(1))
    pairs = zip(board_pictures(K, poses, 5, 4, 0.025), board_pictures(K, poses, 5, 4, 0.025, "software"), strict=True)
    for ours, software in pairs:
        black = [picture.max(axis=2) < 60 for picture in (ours, software)]
        assert black[0].mean() > 0.02
        assert (black[0] != black[1]).mean() < 0.01
