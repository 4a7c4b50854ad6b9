from collections.abc import Callable, Iterator

import cv2
import numpy as np
import pybullet as p
import pytest
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cell import CameraSpec, FixedMount
from regrasp.interfaces.devices import Camera
from regrasp.interfaces.hidden_world import Errors
from regrasp.sim.cameras.camera import CameraMounting, SimCamera, camera_error
from regrasp.sim.cameras.depth_noise import DepthNoise
from regrasp.sim.render.renderer import LightState, make_renderer
from regrasp.sim.render.visuals import Visuals

SPEC = CameraSpec(
    name="wrist",
    width=160,
    height=96,
    rate=15,
    horizontal_fov_deg=65.0,
    depth_fov_deg=65.0,
    baseline=0.05,
    mount=FixedMount(position=(-0.6, 0.0, 0.0), pitch_down_deg=0.0),
)
ERRORS = Errors(
    camera_position=0.002,
    camera_angle_deg=0.3,
    depth_scale=0.015,
    arm_tool=0.0,
    finger_noise=0.0,
    finger_backlash=0.0,
    finger_resolution=1e-4,
    finger_rate=100,
    depth_subpixel=0.2,
    depth_fixed_share=0.5,
)
LATENCY = 0.1  # seconds: one and a half frames


class Rig:
    """A ball before a camera, and a clock that the test turns."""

    def __init__(self, client: int) -> None:
        shape = p.createVisualShape(p.GEOM_SPHERE, radius=0.05, physicsClientId=client)
        self.ball = p.createMultiBody(0, -1, shape, physicsClientId=client)
        self.client = client
        self.time = 0.0
        self.joints = np.zeros(6)
        self.pose = SPEC.mount.world_from_camera if isinstance(SPEC.mount, FixedMount) else RigidTransform.identity()
        self.visuals = Visuals(client)
        self.camera = self.make_camera()

    def make_camera(self) -> SimCamera:
        renderer, light = make_renderer(self.visuals), LightState((-0.5, 0.3, 1.0), 0.45, 0.55)
        noise = DepthNoise(SPEC, ERRORS, seed=1)
        joints = lambda: self.joints  # noqa: E731
        mounting = CameraMounting(self.expose, joints)
        return SimCamera(SPEC, renderer, light, noise, mounting, lambda: self.time, LATENCY)

    def expose(self) -> Callable[[], RigidTransform]:
        pose = self.pose
        return lambda: pose

    def move(self, left: float) -> None:
        p.resetBasePositionAndOrientation(self.ball, [0, left, 0], [0, 0, 0, 1], physicsClientId=self.client)

    def ball_column(self) -> float:
        ids = self.camera.true_ids()
        assert ids is not None
        return float(np.nonzero(ids == self.ball)[1].mean())


@pytest.fixture
def rig() -> Iterator[Rig]:
    client = p.connect(p.DIRECT)
    yield Rig(client)
    p.disconnect(client)


def test_it_is_a_camera(rig: Rig) -> None:
    camera: Camera = rig.camera
    assert camera.name == "wrist"


def test_a_frame_appears_when_its_latency_has_passed(rig: Rig) -> None:
    #  time    0     0.066  0.1   0.133  0.166  0.199  0.233
    #  exposed 1     2      -     3      4      -      -
    #  latest  None  None   1     1      2      2      3
    seen = []
    for tick, expose in enumerate([True, True, False, True, True, False, False]):
        rig.time = [0.0, 1 / 15, 0.1, 2 / 15, 1 / 15 + 0.1, 0.199, 2 / 15 + 0.1][tick]
        if expose:
            rig.camera.expose()
        frame = rig.camera.latest()
        seen.append(frame and (frame.number, round(frame.stamp, 3)))
    assert seen == [None, None, (1, 0.0), (1, 0.0), (2, 0.067), (2, 0.067), (3, 0.133)]


def test_a_frame_shows_the_world_and_joints_at_its_exposure_not_at_its_reading(rig: Rig) -> None:
    rig.joints[:] = 0.5
    rig.move(0.1)
    rig.camera.expose()
    rig.move(-0.1)
    rig.joints[:] = 0.7
    rig.pose = RigidTransform.from_translation([0.0, 0.0, 5.0]) * rig.pose
    rig.time = 0.1
    assert rig.ball_column() < 70  # y is left
    frame = rig.camera.latest()
    assert frame is not None
    assert frame.joints is not None
    assert frame.joints.tolist() == [0.5] * 6


def test_the_same_frame_again_until_the_next_is_there(rig: Rig) -> None:
    rig.camera.expose()
    rig.time = 0.1
    first = rig.camera.latest()
    ids = rig.camera.true_ids()
    rig.camera.expose()
    rig.time = 0.19
    assert rig.camera.latest() is first
    assert rig.camera.true_ids() is ids
    rig.time = 0.2
    second = rig.camera.latest()
    assert first is not None
    assert second is not None
    assert second.number == 2


def test_a_preview_is_the_newest_frame_made_smaller(rig: Rig) -> None:
    renderer = make_renderer(rig.visuals)
    assert rig.camera.deferred_preview(2) is None
    rig.move(0.05)
    rig.camera.expose()
    rig.move(-0.1)
    rig.time = 0.1
    draw, frame, shrink = rig.camera.deferred_preview(2), rig.camera.latest(), rig.camera.deferred_preview(2)
    assert draw is not None
    assert frame is not None
    assert shrink is not None
    rig.camera.expose()
    rig.time = 0.2
    small, again = draw(renderer), shrink(renderer)  # of the instant when they were asked for
    height, width = small.shape[:2]
    assert again.shape == small.shape
    assert (height, width) == (SPEC.height // 2, SPEC.width // 2)
    expected = cv2.resize(frame.rgb, (width, height), interpolation=cv2.INTER_AREA)
    off = np.abs(small.astype(int) - expected).max(axis=2)
    assert float((off > 12).mean()) < 0.02  # the ball's edge
    rig.camera.transmission = 0.5
    rig.camera.expose()
    rig.time = 0.3
    draw = rig.camera.deferred_preview(2)
    assert draw is not None
    dark = draw(renderer)
    assert float(dark.mean()) < 0.6 * float(small.mean())


def test_readers_change_nothing(rig: Rig) -> None:
    """One camera is read at every exposure, the other once at the end: the last frames are the same."""
    rig.time = 0.0
    other = rig.make_camera()
    for number in range(1, 8):
        rig.time = number / 15
        rig.move(0.01 * number)
        poses = rig.visuals.deferred_snapshot()
        rig.camera.expose(poses)
        other.expose(poses)
        rig.camera.latest()
    rig.time = 7 / 15 + LATENCY
    a, b = rig.camera.latest(), other.latest()
    assert a is not None
    assert b is not None
    assert a.number == b.number == 7
    assert np.array_equal(a.rgb, b.rgb)
    assert np.array_equal(a.depth, b.depth)


def test_depth_is_measured_and_truth_is_exact(rig: Rig) -> None:
    rig.camera.expose()
    rig.time = 0.1
    frame, ids = rig.camera.latest(), rig.camera.true_ids()
    assert frame is not None
    assert ids is not None
    on_ball = (ids == rig.ball) & (frame.depth > 0)
    assert np.median(frame.depth[on_ball]) == pytest.approx(0.56, abs=0.03)
    assert (frame.depth[ids == -1] == 0).all()
    radius = 0.05 / np.sqrt(0.6**2 - 0.05**2) * SPEC.intrinsics.fx
    assert (ids == rig.ball).sum() == pytest.approx(np.pi * radius**2, rel=0.06)


def test_true_ids_before_the_first_frame(rig: Rig) -> None:
    assert rig.camera.true_ids() is None


def test_camera_error_has_the_stated_size() -> None:
    rng = np.random.default_rng(0)
    draws = [camera_error(ERRORS, rng) for _ in range(2000)]
    shifts = np.array([d.translation for d in draws])
    assert shifts.std(axis=0) == pytest.approx(0.002, rel=0.06)
    assert np.abs(shifts.mean(axis=0)).max() < 2e-4
    turns = np.array([d.rotation.as_rotvec(degrees=True) for d in draws])
    assert np.sqrt((turns**2).sum(axis=1).mean()) == pytest.approx(0.3, rel=0.06)
    assert turns.std(axis=0) == pytest.approx(0.3 / np.sqrt(3), rel=0.1)  # no axis is preferred
    again = camera_error(ERRORS, np.random.default_rng(0))
    assert np.array_equal(again.as_matrix(), draws[0].as_matrix())
