"""The devices of a world: its arms, and its cameras with the renderer and the light that they see by."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cell import CameraSpec, Cell, WristMount
from regrasp.interfaces.hidden_world import Light
from regrasp.sim.cameras.camera import CameraMounting, SimCamera, camera_error
from regrasp.sim.cameras.depth_noise import DepthNoise, DepthNoiseParameters
from regrasp.sim.engine import Engine
from regrasp.sim.render.renderer import LightState, Renderer, RendererName, make_renderer
from regrasp.sim.render.visuals import Visuals
from regrasp.sim.robot.arm import ArmParameters, SimArm
from regrasp.sim.robot.gripper import GripperParameters


@dataclass(frozen=True)
class DeviceParameters:
    """Tuning values of the devices. What describes a certain cell is in its file."""

    smallest_brightness: float = 0.3  # lower limit of the random factor on the light; choice: cameras still see
    arm: ArmParameters = field(default_factory=ArmParameters)
    gripper: GripperParameters = field(default_factory=GripperParameters)
    depth_noise: DepthNoiseParameters = field(default_factory=DepthNoiseParameters)


class Devices:
    """The cell's arms at once, and from `add_cameras` on its cameras, by their names. Errors are drawn from `seed`."""

    visuals: Visuals
    renderer: Renderer
    light: LightState

    def __init__(self, engine: Engine, cell: Cell, seed: int, parameters: DeviceParameters) -> None:
        self._engine, self._cell, self._seed, self._parameters = engine, cell, seed, parameters
        errors, light = np.random.SeedSequence([seed, 1]).spawn(2)
        self._errors_rng, self._light_rng = np.random.default_rng(errors), np.random.default_rng(light)
        self.arms = {
            spec.name: SimArm(engine.client, cell, spec.name, self._errors_rng, parameters.arm, parameters.gripper)
            for spec in cell.known.arms
        }
        self.cameras: dict[str, SimCamera] = {}
        self._next_exposure = 0.0  # the step at which a camera exposes next

    def add_cameras(self, renderer: RendererName) -> None:
        """Add what sees: the cameras draw the bodies that are in the engine now, and none that comes later."""
        self.visuals = Visuals(self._engine.client)
        self.renderer = make_renderer(self.visuals, renderer)
        self.light = _draw_light(self._cell.hidden.light, self._light_rng, self._parameters.smallest_brightness)
        for spec in self._cell.known.cameras:
            self.cameras[spec.name] = self._make_camera(spec)

    def set_light(self, light: LightState) -> None:
        """Change the light for all later exposures."""
        self.light = light
        for camera in self.cameras.values():
            camera.light = light

    def restart_clocks(self) -> None:
        """Set the arms' clocks to zero."""
        for arm in self.arms.values():
            arm.restart_clock()

    def step(self) -> None:
        """Set the arms' servos for the next physics step."""
        for arm in self.arms.values():
            arm.step()

    def expose(self) -> None:
        """Let each camera expose for which it is time."""
        if self._engine.steps < self._next_exposure:
            return
        steps, rate = self._engine.steps, self._engine.step_rate
        poses = self.visuals.deferred_snapshot()
        for camera in self.cameras.values():
            if steps * camera.rate % rate < camera.rate:
                camera.expose(poses)
        # The next step on which any camera has exposed once more.
        following = (-(-(steps * c.rate // rate + 1) * rate // c.rate) for c in self.cameras.values())
        self._next_exposure = min(following, default=math.inf)

    def _make_camera(self, spec: CameraSpec) -> SimCamera:
        known, errors = self._cell.known, self._cell.hidden.errors
        error, mount = camera_error(errors, self._errors_rng), spec.mount
        return SimCamera(
            spec=spec,
            renderer=self.renderer,
            light=self.light,
            noise=DepthNoise(spec, errors, self._seed, self._parameters.depth_noise),
            mounting=_wrist_mounting(self.arms[mount.arm], mount, error)
            if isinstance(mount, WristMount)
            else _fixed_mounting(mount.world_from_camera * error),
            now=self._engine.now,
            latency=known.latencies.image,
        )


def _draw_light(light: Light, rng: np.random.Generator, smallest_brightness: float) -> LightState:
    turn = Rotation.from_rotvec(np.deg2rad(light.direction_jitter_deg) * rng.normal(size=3) / np.sqrt(3))
    factor = max(smallest_brightness, 1.0 + light.brightness_jitter * float(rng.normal()))
    direction = turn.apply(np.asarray(light.direction) / np.linalg.norm(light.direction))
    return LightState(direction, light.ambient * factor, light.diffuse * factor)


def _wrist_mounting(arm: SimArm, mount: WristMount, error: RigidTransform) -> CameraMounting:
    def expose() -> Callable[[], RigidTransform]:
        pose = arm.deferred_mount_pose()
        return lambda: pose() * mount.mount_from_camera * error

    return CameraMounting(expose, lambda: arm.reading().positions)


def _fixed_mounting(world_from_camera: RigidTransform) -> CameraMounting:
    return CameraMounting(lambda: lambda: world_from_camera)
