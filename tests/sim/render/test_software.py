"""The software renderer draws what the OpenGL renderer draws."""

from collections.abc import Iterator

import cv2
import numpy as np
import pybullet as p
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.frame import Intrinsics
from regrasp.sim.render.opengl import GlRenderer
from regrasp.sim.render.picture import Z_FAR, Z_NEAR, Image, LightState
from regrasp.sim.render.raster import draw_triangles
from regrasp.sim.render.shading import sine
from regrasp.sim.render.software import SoftwareRenderer
from regrasp.sim.render.visuals import Visuals

K = Intrinsics(160, 120, 130.0, 125.0, 83.3, 57.9)
LIGHT = LightState((-0.5, 0.3, -1.0), 0.45, 0.55)  # from behind a camera that looks along z
HALF = (0.05, 0.12, 0.03)
NUMBER = st.floats(-1.0, 1.0, width=32)
POSES = st.lists(st.tuples(*[NUMBER] * 6), min_size=5, max_size=5)


@pytest.fixture(scope="module")
def visuals() -> Iterator[Visuals]:
    """Two boxes, a ball, a cylinder and a capsule."""
    client = p.connect(p.DIRECT)
    for kind, size in (
        (p.GEOM_BOX, {"halfExtents": HALF}),
        (p.GEOM_BOX, {"halfExtents": (0.8, 0.6, 0.02)}),
        (p.GEOM_SPHERE, {"radius": 0.07}),
        (p.GEOM_CYLINDER, {"radius": 0.03, "length": 0.2}),
        (p.GEOM_CAPSULE, {"radius": 0.004, "length": 0.15}),
    ):
        shape = p.createVisualShape(kind, rgbaColor=[0.8, 0.6, 0.4, 1], physicsClientId=client, **size)
        p.createMultiBody(0, -1, shape, physicsClientId=client)
    yield Visuals(client)
    p.disconnect(client)


@pytest.fixture(scope="module")
def software(visuals: Visuals) -> SoftwareRenderer:
    return SoftwareRenderer(visuals)


@pytest.fixture(scope="module")
def opengl(visuals: Visuals) -> Iterator[GlRenderer]:
    try:
        renderer = GlRenderer(visuals)
    except Exception as error:
        pytest.skip(f"no EGL here: {error}")
    yield renderer
    renderer.close()


def placed(places: list[tuple[float, ...]]) -> NDArray[np.float32]:
    """Poses about the camera at the origin: some in front of it, some behind it, some about it."""
    poses = np.empty((len(places), 3, 4), np.float32)
    for pose, (x, y, z, *turn) in zip(poses, places, strict=True):
        pose[:, 3] = 0.4 * x, 0.3 * y, 0.4 + 0.6 * z
        pose[:, :3] = Rotation.from_rotvec(3.0 * np.array(turn)).as_matrix()
    return poses


def away_from_edges(image: Image) -> NDArray[np.bool_]:
    """Pixels whose eight neighbours show the same item."""
    ids = image.ids.astype(np.float32)
    kernel = np.ones((3, 3), np.uint8)
    return np.asarray(cv2.dilate(ids, kernel) == cv2.erode(ids, kernel))


def depth_range(image: Image) -> NDArray[np.float32]:
    """By how much depth differs between a pixel and its neighbours."""
    kernel = np.ones((3, 3), np.uint8)
    return np.asarray(cv2.dilate(image.depth, kernel) - cv2.erode(image.depth, kernel))


@settings(max_examples=150)
@example(
    [(0.0, 0.0, 0.0, 0.0, 0.0, 0.5), (-0.0766790360212326, 0.0, 0.03515625, 0.0004, -0.5319495797157288, 0.0)]
    + [(0.0,) * 6] * 3
)
@given(POSES)
def test_both_renderers_draw_the_same(
    software: SoftwareRenderer, opengl: GlRenderer, places: list[tuple[float, ...]]
) -> None:
    poses = placed(places)
    ours, theirs = (r.render(poses, RigidTransform.identity(), K, LIGHT) for r in (software, opengl))
    inside = away_from_edges(ours) & away_from_edges(theirs)  # a plate seen edge-on is a line that either may end first
    assert np.array_equal(ours.ids[inside], theirs.ids[inside])
    assert (ours.ids != theirs.ids).mean() < 2e-3
    # OpenGL moves corners by up to 1/512 of a pixel
    assert (np.abs(ours.depth - theirs.depth) < 1e-4 + 0.01 * depth_range(theirs))[inside].all()
    off = np.abs(ours.rgb.astype(int) - theirs.rgb).max(axis=2)
    assert (off[inside] > 2).sum() < 0.01 * inside.sum() + 5


@given(POSES)
def test_nothing_is_drawn_outside_the_clip_planes_and_each_picture_stands_alone(
    visuals: Visuals, software: SoftwareRenderer, places: list[tuple[float, ...]]
) -> None:
    poses = placed(places)
    image = software.render(poses, RigidTransform.identity(), K, LIGHT)
    assert np.array_equal(image.ids == -1, image.depth == 0.0)
    seen = image.depth[image.ids >= 0]
    assert ((seen > Z_NEAR - 1e-6) & (seen < Z_FAR)).all()
    fresh = SoftwareRenderer(visuals).render(poses, RigidTransform.identity(), K, LIGHT)
    for a, b in ((image.rgb, fresh.rgb), (image.depth, fresh.depth), (image.ids, fresh.ids)):
        assert np.array_equal(a, b)


@given(st.tuples(*[NUMBER] * 3), st.tuples(*[NUMBER] * 2), st.floats(0.2, 3.0))
def test_a_wall_has_no_holes_where_its_triangles_meet(
    software: SoftwareRenderer, turn: tuple[float, ...], at: tuple[float, ...], depth: float
) -> None:
    """The large box fills the picture: its front is two triangles, whose common edge may lie anywhere."""
    poses = placed([(0.0, 0.0, -20.0, 0.0, 0.0, 0.0)] * 5)
    poses[1, :, :3] = Rotation.from_rotvec([0.0, 0.0, np.pi * turn[2]]).as_matrix()
    poses[1, :, 3] = 0.1 * depth * at[0], 0.1 * depth * at[1], 0.02 + depth / 6
    image = software.render(poses, RigidTransform.identity(), K, LIGHT)
    shown = image.ids == 1
    corners = np.array([[x, y, -0.02] for x, y in ((-0.8, -0.6), (0.8, -0.6), (0.8, 0.6), (-0.8, 0.6))])
    q = corners @ poses[1, :, :3].T + poses[1, :, 3]
    outline = np.column_stack([K.fx * q[:, 0] / q[:, 2] + K.cx, K.fy * q[:, 1] / q[:, 2] + K.cy])
    away = [
        [cv2.pointPolygonTest(outline.astype(np.float32), (u, v), True) for u in range(K.width)]
        for v in range(K.height)
    ]
    assert shown[np.array(away) > 0.01].all()
    assert not shown[np.array(away) < -0.01].any()
    assert np.abs(image.depth[shown] - depth / 6).max() < 1e-5


@given(st.integers(1, 15), st.integers(1, 15))
def test_triangles_that_meet_on_pixels_draw_each_of_them_once(x: int, y: int) -> None:
    """Four triangles make up a square from pixel 2 to pixel 10; they meet at half a pixel's steps in it."""
    flat = [[2.0, 2.0], [10.0, 2.0], [10.0, 10.0], [2.0, 10.0], [2.0 + x / 2, 2.0 + y / 2]]
    corners = np.array([[u, v, 1.0, 1.0, u, v] for u, v in flat])
    drawn = np.zeros((12, 12), int)
    for i in range(4):
        nearest = np.zeros((12, 12), np.float32)
        triangles = np.array([[4, (i + 1) % 4, i]], np.int32)
        draw_triangles(corners, np.array([0]), np.array([0, 1]), triangles, 0.0, nearest, None)
        drawn += nearest > 0.0
    expected = np.zeros((12, 12), int)
    expected[2:10, 2:10] = 1
    np.testing.assert_array_equal(drawn, expected)


@pytest.mark.parametrize("depth", [0.0, -0.5])
def test_a_camera_in_a_box_or_before_it_sees_nothing_of_it(software: SoftwareRenderer, depth: float) -> None:
    poses = placed([(0.0, 0.0, -20.0, 0.0, 0.0, 0.0)] * 5)
    poses[0, :, 3] = 0.0, 0.0, depth
    image = software.render(poses, RigidTransform.identity(), K, LIGHT)
    assert (image.ids == -1).all()


def test_a_floor_under_the_camera_is_drawn_up_to_the_near_plane(software: SoftwareRenderer) -> None:
    """It runs from behind the camera to 0.6 m in front of it, 1 cm below: rows show it at fy * 0.01 / (v - cy)."""
    poses = placed([(0.0, 0.0, -20.0, 0.0, 0.0, 0.0)] * 5)
    poses[1, :, :3] = Rotation.from_euler("x", 90, degrees=True).as_matrix()
    poses[1, :, 3] = 0.0, 0.03, 0.0
    image = software.render(poses, RigidTransform.identity(), K, LIGHT)
    rows = np.arange(K.height)
    depth = K.fy * 0.01 / np.maximum(rows - K.cy, 1e-9)
    on_it = (depth < 0.6) & (depth > Z_NEAR)
    assert np.array_equal((image.ids == 1).all(axis=1), on_it)
    assert np.array_equal((image.ids == 1).any(axis=1), on_it)
    np.testing.assert_allclose(
        image.depth[on_it], np.broadcast_to(depth[on_it, None], (on_it.sum(), K.width)), rtol=1e-5
    )


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of the shadow map's bounds
@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf, 1e30])
def test_what_lies_nowhere_is_not_drawn(software: SoftwareRenderer, wrong: float) -> None:
    """A physics step may blow up: the others are drawn as ever, but for the shadows, whose map has no bounds."""
    poses = placed([(0.0, 0.0, 0.2 * i, 0.0, 0.0, 0.0) for i in range(5)])
    poses[0, 0, 3] = wrong
    image = software.render(poses, RigidTransform.identity(), K, LIGHT)
    poses[0, :, 3] = 0.0, 0.0, -9.0
    assert np.array_equal(image.ids, software.render(poses, RigidTransform.identity(), K, LIGHT).ids)


def test_an_empty_scene_is_all_background() -> None:
    client = p.connect(p.DIRECT)
    renderer = SoftwareRenderer(Visuals(client))
    p.disconnect(client)
    image = renderer.render(np.zeros((0, 3, 4), np.float32), RigidTransform.identity(), K, LIGHT)
    assert (image.ids == -1).all()
    assert np.unique(image.rgb.reshape(-1, 3), axis=0).tolist() == [[184, 189, 199]]


@given(st.floats(-1000.0, 1000.0, width=32))
def test_the_grains_sine_is_a_sine(x: float) -> None:
    assert sine(np.float32(x)) == pytest.approx(np.sin(x), abs=2e-4)
