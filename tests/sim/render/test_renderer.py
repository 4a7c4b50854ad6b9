from collections.abc import Iterator
from pathlib import Path

import cv2
import moderngl
import numpy as np
import pybullet as p
import pytest
from numpy.typing import NDArray
from robots import VX300S
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cell import OPTICAL
from regrasp.interfaces.frame import Intrinsics
from regrasp.sim.render.meshes import triangle_corners
from regrasp.sim.render.renderer import Image, LightState, Renderer, make_renderer
from regrasp.sim.render.software import SoftwareRenderer
from regrasp.sim.render.visuals import Visuals
from regrasp.sim.robot.model import robot_urdf

K = Intrinsics.from_fov(424, 240, np.deg2rad(65.0))
LIGHT = LightState((-0.5, 0.3, 1.0), 0.45, 0.55)
FLOOR_COLOR = (0.5, 0.6, 0.7)
NAMES = pytest.mark.parametrize("name", ["moderngl", "software"])


def looking(position: tuple[float, float, float], yaw_deg: float, pitch_down_deg: float) -> RigidTransform:
    return RigidTransform.from_components(
        position, Rotation.from_euler("ZY", [yaw_deg, pitch_down_deg], degrees=True) * OPTICAL
    )


CAMERA = looking((-0.6, 0.0, 0.45), 0.0, 25.0)


def add(
    client: int, kind: int, at: tuple[float, float, float], color: tuple[float, float, float], **size: object
) -> int:
    shape = p.createVisualShape(kind, rgbaColor=[*color, 1], physicsClientId=client, **size)
    return int(p.createMultiBody(0, -1, shape, at, [0.1, 0.2, 0.3, 0.927], physicsClientId=client))


def add_floor(client: int) -> int:
    shape = p.createVisualShape(
        p.GEOM_BOX, halfExtents=[2, 2, 0.05], rgbaColor=[*FLOOR_COLOR, 1], physicsClientId=client
    )
    return int(p.createMultiBody(0, -1, shape, [0, 0, -0.05], physicsClientId=client))


@pytest.fixture
def client() -> Iterator[int]:
    number = p.connect(p.DIRECT)
    yield number
    p.disconnect(number)


@pytest.fixture
def scene(client: int, tmp_path: Path) -> Visuals:
    add_floor(client)
    add(client, p.GEOM_BOX, (0.3, 0.3, 0.2), (0.8, 0.2, 0.2), halfExtents=[0.05, 0.1, 0.08])
    add(client, p.GEOM_SPHERE, (0.3, -0.3, 0.1), (0.2, 0.8, 0.2), radius=0.08)
    add(client, p.GEOM_CAPSULE, (0.2, -0.1, 0.3), (0.2, 0.2, 0.8), radius=0.02, length=0.2)
    add(client, p.GEOM_CYLINDER, (0.2, 0.05, 0.3), (0.7, 0.0, 0.1), radius=0.02, length=0.2)
    (tmp_path / "robot.urdf").write_text(robot_urdf(VX300S, None))
    p.loadURDF(str(tmp_path / "robot.urdf"), [0.3, 0.0, 0.0], useFixedBase=True, physicsClientId=client)
    return Visuals(client)


def renderer_of(visuals: Visuals, name: str) -> Renderer:
    if name == "software":
        return make_renderer(visuals, "software")
    try:
        return make_renderer(visuals, "moderngl")
    except Exception as error:
        pytest.skip(f"no EGL here: {error}")


def plane_depth(camera: RigidTransform) -> NDArray[np.float64]:
    """Depth (H, W) of the plane z = 0 along the optical axis, by ray and plane."""
    v, u = np.mgrid[: K.height, : K.width]
    rays = np.stack([(u - K.cx) / K.fx, (v - K.cy) / K.fy, np.ones_like(u, float)], axis=-1)
    depth: NDArray[np.float64] = -camera.translation[2] / (rays @ camera.rotation.as_matrix()[2])
    return depth


def project(camera: RigidTransform, points: NDArray[np.float64]) -> NDArray[np.float64]:
    q = camera.inv().apply(points)
    return np.column_stack([K.fx * q[:, 0] / q[:, 2] + K.cx, K.fy * q[:, 1] / q[:, 2] + K.cy])


@NAMES
def test_depth_of_the_floor_is_exact_and_nothing_is_behind_it(scene: Visuals, name: str) -> None:
    image = renderer_of(scene, name).render(scene.snapshot(), CAMERA, K, LIGHT)
    floor = image.ids == 0
    assert floor.mean() > 0.3
    assert np.abs(image.depth - plane_depth(CAMERA))[floor].max() < 1e-4
    assert (image.ids == -1).any()
    assert np.array_equal(image.ids == -1, image.depth == 0)


@NAMES
def test_corners_of_boxes_lie_where_the_intrinsics_put_them(client: int, name: str) -> None:
    half = np.array([0.05, 0.08, 0.03])
    add(client, p.GEOM_BOX, (0, 0, 0), (1, 1, 1), halfExtents=half.tolist())
    visuals = Visuals(client)
    renderer = renderer_of(visuals, name)
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    rng = np.random.default_rng(1)
    for _ in range(10):
        pose = RigidTransform.from_components(
            rng.uniform([0.1, -0.2, -0.05], [0.4, 0.2, 0.2]), Rotation.random(rng=rng)
        )
        image = renderer.render(pose.as_matrix()[None, :3].astype(np.float32), CAMERA, K, LIGHT)
        v, u = np.nonzero(image.ids == 0)
        seen = np.array([u.min(), v.min(), u.max(), v.max()])
        expected = project(CAMERA, pose.apply(signs * half))
        inside = np.concatenate([seen[:2] - expected.min(axis=0), expected.max(axis=0) - seen[2:]])
        assert inside.min() > -0.05
        assert inside.max() < 1.5  # no pixel's centre need lie in the last pixel of a pointed corner
        centroid = np.array([u.mean(), v.mean()])
        assert np.abs(centroid - _hull_centroid(expected)).max() < 0.15


def _hull_centroid(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Centroid of the points' convex hull, pixel by pixel at 8 times the resolution."""
    hull = cv2.convexHull(((points + 0.5) * 8).astype(np.float32))
    moments = cv2.moments(hull)
    centroid: NDArray[np.float64] = np.array([moments["m10"], moments["m01"]]) / moments["m00"] / 8 - 0.5
    return centroid


@NAMES
def test_colours_alone_are_those_of_the_picture(scene: Visuals, name: str) -> None:
    renderer, view = renderer_of(scene, name), (scene.snapshot(), CAMERA, K, LIGHT)
    assert np.array_equal(renderer.render_color(*view), renderer.render(*view).rgb)


def test_both_renderers_see_the_same(scene: Visuals) -> None:
    a, b = (renderer_of(scene, name).render(scene.snapshot(), CAMERA, K, LIGHT) for name in ("moderngl", "software"))
    assert (a.ids == b.ids).mean() > 0.999
    both = (a.ids == b.ids) & (a.ids >= 0)
    assert np.quantile(np.abs(a.depth - b.depth)[both], 0.999) < 1e-4
    off = np.abs(a.rgb.astype(int) - b.rgb).max(axis=2)
    assert (off <= 2).mean() > 0.999
    assert (off[(a.ids == -1) & (b.ids == -1)] == 0).all()


@NAMES
def test_a_box_throws_its_shadow_away_from_the_light(client: int, name: str) -> None:
    add_floor(client)
    shape = p.createVisualShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.02], physicsClientId=client)
    p.createMultiBody(0, -1, shape, [0.0, 0.0, 0.3], physicsClientId=client)
    visuals = Visuals(client)
    image = renderer_of(visuals, name).render(visuals.snapshot(), CAMERA, K, LIGHT)
    under = np.array([0.15, -0.09, 0.0])  # 0.3 up along the light's direction lies the box's centre
    shaded, lit = _brightness(image, under), _brightness(image, under + np.array([0.0, 0.35, 0.0]))
    assert shaded < 0.55 * lit  # ambient light alone gives 0.49


def _brightness(image: Image, point: NDArray[np.float64]) -> float:
    u, v = np.rint(project(CAMERA, point[None]))[0].astype(int)
    assert (image.ids[v - 3 : v + 4, u - 3 : u + 4] == 0).all()
    return float(image.rgb[v - 3 : v + 4, u - 3 : u + 4].mean())


@NAMES
def test_lit_floor_has_lamberts_brightness_and_no_stripes(client: int, name: str) -> None:
    add_floor(client)
    add(client, p.GEOM_BOX, (0.3, 0.3, 0.2), (1, 1, 1), halfExtents=[0.05, 0.1, 0.08])
    visuals = Visuals(client)
    image = renderer_of(visuals, name).render(visuals.snapshot(), CAMERA, K, LIGHT)
    facing = 1.0 / np.linalg.norm(np.asarray(LIGHT.direction))
    expected = 255 * np.array(FLOOR_COLOR) * (LIGHT.ambient + LIGHT.diffuse * facing)
    lit = (image.ids == 0) & (np.arange(K.width) > K.width / 2)  # the right half is clear of the shadow
    assert np.abs(image.rgb[lit] / expected - 1.0).max() < 0.05


@NAMES
def test_a_ball_and_a_cable_are_as_wide_as_they_should_be(client: int, name: str) -> None:
    add(client, p.GEOM_SPHERE, (0, 0, 0), (1, 1, 1), radius=0.05)
    add(client, p.GEOM_CAPSULE, (0, 0, 0), (1, 1, 1), radius=0.0035, length=0.03)
    visuals = Visuals(client)
    renderer = renderer_of(visuals, name)
    k = Intrinsics.from_fov(848, 480, np.deg2rad(20.0))
    poses = np.tile(np.eye(4)[:3], (2, 1, 1)).astype(np.float32)
    poses[:, :, 3] = [[-0.06, 0.0, 0.6], [0.05, 0.0, 0.6]]
    poses[1, :, :3] = Rotation.from_euler("x", 90, degrees=True).as_matrix()
    image = renderer.render(poses, RigidTransform.identity(), k, LIGHT)
    ball = np.pi * 0.05**2 * (k.fx / 0.6) ** 2
    cable = (2 * 0.0035 * 0.03 + np.pi * 0.0035**2) * (k.fx / 0.6) ** 2
    assert (image.ids == 0).sum() == pytest.approx(ball, rel=0.03)
    assert (image.ids == 1).sum() == pytest.approx(cable, rel=0.03)


def test_every_mesh_is_turned_outwards(scene: Visuals) -> None:
    for item in scene.items:
        rows = triangle_corners(item).astype(float)
        triangle, normal = rows[:, :3].reshape(-1, 3, 3), rows[:, 3:].reshape(-1, 3, 3)
        area = np.cross(triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0])
        assert np.einsum("ij,ij->", triangle[:, 0], area) > 0
        assert (np.einsum("ij,ikj->ik", area, normal) > 0).mean() > 0.99
        assert np.allclose(np.linalg.norm(normal, axis=2), 1.0, atol=1e-4)


@NAMES
def test_what_was_drawn_before_does_not_show(scene: Visuals, name: str) -> None:
    """Poses, light and camera of earlier pictures are kept: none may leak into a later one."""
    poses = scene.snapshot()
    moved = poses.copy()
    moved[:, 0, 3] += 0.1
    other = LightState((1.0, 0.0, 1.0), 0.3, 0.5)
    views = [(poses, CAMERA, LIGHT), (poses, looking((-0.5, 0.2, 0.3), -10.0, 10.0), LIGHT), (moved, CAMERA, LIGHT)]
    views += [(poses, CAMERA, other), (poses, CAMERA, LIGHT)]
    renderer = renderer_of(scene, name)
    for at, camera, light in views:
        again = renderer.render(at, camera, K, light)
        fresh = renderer_of(scene, name).render(at, camera, K, light)
        assert np.array_equal(again.rgb, fresh.rgb)
        assert np.array_equal(again.depth, fresh.depth)
        assert np.array_equal(again.ids, fresh.ids)
    moved[:, 0, 3] -= 0.1  # an array that may be written to is read anew each time
    assert np.array_equal(renderer.render(moved, CAMERA, K, LIGHT).ids[:100], again.ids[:100])


def test_without_egl_opengl_is_refused_and_the_default_draws(scene: Visuals, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(**_: object) -> None:
        raise Exception("cannot open libEGL")

    monkeypatch.setattr(moderngl, "create_context", refuse)
    assert isinstance(make_renderer(scene), SoftwareRenderer)
    with pytest.raises(Exception, match="libEGL"):
        make_renderer(scene, "moderngl")
