"""A simulated RGB-D camera."""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cell import CameraSpec
from regrasp.interfaces.frame import Intrinsics, RgbdFrame
from regrasp.interfaces.hidden_world import Errors
from regrasp.sim.cameras.depth_noise import DepthNoise
from regrasp.sim.render.picture import LightState
from regrasp.sim.render.renderer import Renderer
from regrasp.sim.render.visuals import Visuals

LEAK = 0.02  # share of the light that comes past a cover


@dataclass(frozen=True, eq=False)
class _Exposure:
    """What is needed to draw the picture later, if anyone asks."""

    number: int
    stamp: float
    poses: NDArray[np.float32]
    world_from_camera: RigidTransform
    joints: NDArray[np.float64] | None
    light: LightState
    taken: int  # the number that keys the noise: an older one's when the picture is a repeated one
    covered: bool
    depthless: bool


class SimCamera:
    """A `regrasp.interfaces.devices.Camera`: the world calls `expose` at the camera's rate, readers call `latest`.

    `true_pose` gives world_from_camera with the calibration's error in it; `joints` the encoder readings (6,) of the
    arm that carries the camera, None for a fixed one; `now` the simulated seconds; `latency` is the seconds from an
    exposure until its frame can be read.

    Faults, set from outside, count for the exposures to come: `drops` says of each whether it gets lost, `frozen`
    repeats the last picture under new numbers, `covered` is a cap on the lens, `depthless` a depth imager that fails.
    """

    def __init__(
        self,
        spec: CameraSpec,
        visuals: Visuals,
        renderer: Renderer,
        light: LightState,
        noise: DepthNoise,
        true_pose: Callable[[], RigidTransform],
        joints: Callable[[], NDArray[np.float64]] | None,
        now: Callable[[], float],
        latency: float,
    ) -> None:
        self.name: str = spec.name
        self.spec = spec
        self._intrinsics = spec.intrinsics
        self._visuals = visuals
        self._renderer, self.light, self._noise = renderer, light, noise
        self.drops: Callable[[], bool] | None = None
        self.frozen = self.covered = self.depthless = False
        self._true_pose, self._joints, self._now, self._latency = true_pose, joints, now, latency
        self._exposures: deque[_Exposure] = deque(maxlen=int(np.ceil(latency * spec.rate)) + 2)
        self._count = 0
        self._frame: RgbdFrame | None = None
        self._ids: NDArray[np.int32] | None = None

    def expose(self, poses: NDArray[np.float32] | None = None) -> None:
        """Keep this instant. `poses` is a `Visuals.snapshot` of now that cameras exposing together share."""
        poses = self._visuals.snapshot() if poses is None else poses
        self._count += 1
        joints = None if self._joints is None else np.array(self._joints(), float)
        if self.drops is not None and self.drops():
            return
        if self.frozen and self._exposures:
            again = replace(self._exposures[-1], number=self._count, stamp=self._now(), joints=joints)
        else:
            seen = (poses, self._true_pose(), joints, self.light, self._count, self.covered, self.depthless)
            again = _Exposure(self._count, self._now(), *seen)
        self._exposures.append(again)

    def latest(self) -> RgbdFrame | None:
        """See `Camera.latest`. The picture is drawn when it is first asked for."""
        ready = [e for e in self._exposures if e.stamp + self._latency <= self._now() + 1e-9]
        if ready and (self._frame is None or self._frame.number != ready[-1].number):
            self._frame, self._ids = self._draw(ready[-1])
        return self._frame

    def true_ids(self) -> NDArray[np.int32] | None:
        """Ground truth: the `VisualItem.id` that each pixel of `latest()` shows, -1 for none; None before the first."""
        self.latest()
        return self._ids

    def still(self, count: int) -> Iterator[RgbdFrame]:
        """The next `count` frames if nothing moves: the picture drawn once, the depth noise of each frame."""
        now, poses, joints = self._now(), self._visuals.snapshot(), self._joints() if self._joints else None
        image = self._renderer.render(poses, self._true_pose(), self._intrinsics, self.light)
        for i in range(count):
            number, stamp = self._count + 1 + i, now + i / self.spec.rate
            depth = self._noise.apply(image.depth, number)
            yield RgbdFrame(self.name, number, stamp, image.rgb, depth, self._intrinsics, joints)

    def ids(self, poses: NDArray[np.float32], intrinsics: Intrinsics) -> NDArray[np.int32]:
        """Ground truth: the `VisualItem.id` in each pixel of a camera that stands where this one truly does."""
        return self._renderer.render(poses, self._true_pose(), intrinsics, self.light).ids

    def true_pose(self) -> RigidTransform:
        """Ground truth: world_from_camera with the calibration's error in it."""
        return self._true_pose()

    def _draw(self, exposure: _Exposure) -> tuple[RgbdFrame, NDArray[np.int32]]:
        image = self._renderer.render(exposure.poses, exposure.world_from_camera, self._intrinsics, exposure.light)
        rgb, depth = image.rgb, self._noise.apply(image.depth, exposure.taken)
        if exposure.covered:
            rgb = (rgb * LEAK).astype(np.uint8)
        if exposure.covered or exposure.depthless:
            depth = np.zeros_like(depth)
        frame = RgbdFrame(self.name, exposure.number, exposure.stamp, rgb, depth, self._intrinsics, exposure.joints)
        return frame, image.ids


def camera_error(errors: Errors, rng: np.random.Generator) -> RigidTransform:
    """A draw of nominal_from_true: where a camera's optical frame really is, seen from where it is believed to be."""
    axis = rng.standard_normal(3)
    angle = np.deg2rad(errors.camera_angle_deg) * rng.standard_normal()
    turn = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis))
    return RigidTransform.from_components(errors.camera_position * rng.standard_normal(3), turn)
