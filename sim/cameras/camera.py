"""A simulated RGB-D camera."""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import CameraSpec
from regrasp.interfaces.frame import Intrinsics, RgbdFrame
from regrasp.interfaces.hidden_world import Errors
from regrasp.interfaces.wall_time import counts_as
from regrasp.sim.cameras.depth_noise import DepthNoise
from regrasp.sim.render.picture import LightState
from regrasp.sim.render.renderer import Renderer


@dataclass(frozen=True)
class CameraMounting:
    """What carries a camera.

    `expose` notes where the carrier is now; what it returns works out world_from_camera then, with the calibration's
    error in it: most exposures are never drawn. `joints` gives the encoder readings (6,) rad of the arm that carries
    the camera; it is None for a fixed camera.
    """

    expose: Callable[[], Callable[[], RigidTransform]]
    joints: Callable[[], FloatArray] | None = None


@dataclass(frozen=True, eq=False)
class _Exposure:
    """The state of the world from which the picture is drawn later, if anyone asks for it."""

    number: int
    stamp: float
    poses: Callable[[], NDArray[np.float32]]
    world_from_camera: Callable[[], RigidTransform]
    joints: FloatArray | None
    light: LightState
    noise_number: int  # the number that keys the noise; a repeated picture has that of the first
    transmission: float
    without_depth: bool


class SimCamera:
    """A `regrasp.interfaces.devices.Camera`: the world calls `expose` at the camera's rate, readers call `latest`.

    `now` gives the simulated seconds; `latency` is the time in s from an exposure until its frame can be read.

    Faults are attributes that count for later exposures. `drops` is called for each exposure and tells whether it is
    lost. `frozen` repeats the last picture with new numbers. `transmission` is the share of the light that enters the
    lens; below 1 the lens is covered and no depth is measured. `without_depth` is a depth imager that fails.
    """

    def __init__(
        self,
        spec: CameraSpec,
        renderer: Renderer,
        light: LightState,
        noise: DepthNoise,
        mounting: CameraMounting,
        now: Callable[[], float],
        latency: float,
    ) -> None:
        self.name: str = spec.name
        self.spec, self.rate = spec, spec.rate
        self._intrinsics = spec.intrinsics
        self._visuals = renderer.visuals
        self._renderer, self.light, self._noise = renderer, light, noise
        self.drops: Callable[[], bool] | None = None
        self.frozen = self.without_depth = False
        self.transmission = 1.0
        self._mounting, self._now, self._latency = mounting, now, latency
        self._exposures: deque[_Exposure] = deque(maxlen=int(np.ceil(latency * spec.rate)) + 2)
        self._count = 0
        self._frame: RgbdFrame | None = None
        self._ids: NDArray[np.int32] | None = None

    def expose(self, poses: Callable[[], NDArray[np.float32]] | None = None) -> None:
        """Take a frame now; cameras that expose together share the present `Visuals.deferred_snapshot` as `poses`."""
        poses = self._visuals.deferred_snapshot() if poses is None else poses
        self._count += 1
        joints = None if self._mounting.joints is None else self._mounting.joints().copy()
        if self.drops is not None and self.drops():
            return
        if self.frozen and self._exposures:
            exposure = replace(self._exposures[-1], number=self._count, stamp=self._now(), joints=joints)
        else:
            seen = (poses, self._mounting.expose(), joints, self.light)
            exposure = _Exposure(self._count, self._now(), *seen, self._count, self.transmission, self.without_depth)
        self._exposures.append(exposure)

    @counts_as("rendering")
    def latest(self) -> RgbdFrame | None:
        """See `Camera.latest`. The picture is drawn when it is first read."""
        newest = self._newest()
        if newest and (self._frame is None or self._frame.number != newest.number):
            self._frame, self._ids = self._draw(newest)
        return self._frame

    def deferred_preview(self, shrink: int) -> Callable[[Renderer], NDArray[np.uint8]] | None:
        """A function that draws the colours (H / shrink, W / shrink, 3) of the present `latest()`; None without one.

        It may be called later and in another thread, with a renderer of that thread. Depth is not drawn for it.
        """
        newest, read = self._newest(), self._frame
        if newest is None:
            return None
        if read is not None and read.number == newest.number:  # somebody has read it
            rgb, scale = read.rgb, 1 / shrink
            return lambda _: np.asarray(cv2.resize(rgb, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA))
        small = self._intrinsics.shrunk(shrink)

        def draw(renderer: Renderer) -> NDArray[np.uint8]:
            rgb = renderer.render_color(newest.poses(), newest.world_from_camera(), small, newest.light)
            return _darkened(rgb, newest.transmission)

        return draw

    def _newest(self) -> _Exposure | None:
        """The newest exposure that can be read."""
        ready = [e for e in self._exposures if e.stamp + self._latency <= self._now() + 1e-9]
        return ready[-1] if ready else None

    def true_ids(self) -> NDArray[np.int32] | None:
        """Ground truth: the `VisualItem.id` (H, W) that each pixel of `latest()` shows, -1 for none; None before it."""
        self.latest()
        return self._ids

    def static_frames(self, count: int) -> Iterator[RgbdFrame]:
        """The next `count` frames of a static scene: the picture is drawn once, the depth noise for each frame."""
        now, poses, joints = self._now(), self._visuals.snapshot(), self._mounting.joints and self._mounting.joints()
        image = self._renderer.render(poses, self.true_pose(), self._intrinsics, self.light)
        for i in range(count):
            number, stamp = self._count + 1 + i, now + i / self.spec.rate
            depth = self._noise.apply(image.depth, number)
            yield RgbdFrame(self.name, number, stamp, image.rgb, depth, self._intrinsics, joints)

    def segmentation(self, poses: NDArray[np.float32], intrinsics: Intrinsics) -> NDArray[np.int32]:
        """Ground truth: the `VisualItem.id` (H, W) that each pixel of a camera at this one's true pose would show."""
        return self._renderer.render(poses, self.true_pose(), intrinsics, self.light).ids

    def true_pose(self) -> RigidTransform:
        """Ground truth: world_from_camera with the calibration's error in it."""
        return self._mounting.expose()()

    def _draw(self, exposure: _Exposure) -> tuple[RgbdFrame, NDArray[np.int32]]:
        image = self._renderer.render(exposure.poses(), exposure.world_from_camera(), self._intrinsics, exposure.light)
        rgb, depth = _darkened(image.rgb, exposure.transmission), self._noise.apply(image.depth, exposure.noise_number)
        if exposure.transmission < 1.0 or exposure.without_depth:
            depth = np.zeros_like(depth)
        frame = RgbdFrame(self.name, exposure.number, exposure.stamp, rgb, depth, self._intrinsics, exposure.joints)
        return frame, image.ids


def _darkened(rgb: NDArray[np.uint8], transmission: float) -> NDArray[np.uint8]:
    return (rgb * transmission).astype(np.uint8) if transmission < 1.0 else rgb


def camera_error(errors: Errors, rng: np.random.Generator) -> RigidTransform:
    """A random calibration error: the pose nominal_from_true of the true optical frame in the one that is believed.

    The rotation is about a random axis, by a normally distributed angle; the position error is normal in each axis.
    """
    axis = rng.standard_normal(3)
    angle = np.deg2rad(errors.camera_angle_deg) * rng.standard_normal()
    turn = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis))
    return RigidTransform.from_components(errors.camera_position * rng.standard_normal(3), turn)
