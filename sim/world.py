"""The simulated world of one run: a PyBullet client with the cell, the arms, the cable, the cameras and the faults.

Time passes only in `advance`. Every physics step has the same order: servos, effects of faults, cable springs, clip,
step, socket; then, at intervals, contacts and the triggers of faults. Cameras expose and finger encoders sample at
fixed steps, so nothing depends on who reads them and how often.
"""

import math
import time
import weakref
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import pybullet as p
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import PLUGGED_INTO, CableCell
from regrasp.interfaces.cell import WristMount
from regrasp.interfaces.scene import Gravity, SceneSetup
from regrasp.interfaces.wall_time import counts_as, move_time
from regrasp.sim.build import (
    OUT_OF_SIGHT,
    LayingParameters,
    build_boxes,
    build_props,
    configure,
    filter_collisions,
    lay_cable,
)
from regrasp.sim.cable.cable import CableBody, CableParameters, build_cable
from regrasp.sim.cable.fixtures import BodyLink, ClipHold, ClipParameters, SocketHold
from regrasp.sim.cable.phase import PhaseParameters, PhaseWatch
from regrasp.sim.cameras.camera import CameraMounting, SimCamera, camera_error
from regrasp.sim.cameras.depth_noise import DepthNoise, DepthNoiseParameters
from regrasp.sim.faults.effects import FaultParameters, effect_of
from regrasp.sim.faults.faults import ScheduledFault, TriggerState
from regrasp.sim.render.renderer import LightState, RendererName, make_renderer
from regrasp.sim.render.visuals import Visuals
from regrasp.sim.robot.arm import ArmParameters, SimArm
from regrasp.sim.robot.gripper import GripperParameters


@dataclass(frozen=True)
class WorldParameters:
    """Tuning values of a world and its parts. What describes a certain cell is in its file."""

    contact_interval: int = 4  # physics steps between checks of contacts and of the faults' triggers
    stand_force: float = 3.0  # N that a stand's spring clip holds; choice: a light pull, twice a slack cable's force
    spinning_friction: float = 0.005  # of the connector, against rotation about a contact's normal (PyBullet's unit)
    smallest_brightness: float = 0.3  # lower limit of the random factor on the light; choice: cameras still see
    arm: ArmParameters = field(default_factory=ArmParameters)
    gripper: GripperParameters = field(default_factory=GripperParameters)
    cable: CableParameters = field(default_factory=CableParameters)
    laying: LayingParameters = field(default_factory=LayingParameters)
    clip: ClipParameters = field(default_factory=ClipParameters)
    phase: PhaseParameters = field(default_factory=PhaseParameters)
    depth_noise: DepthNoiseParameters = field(default_factory=DepthNoiseParameters)
    fault: FaultParameters = field(default_factory=FaultParameters)


NOTHING_ADDED = SceneSetup()


class World:
    """The world of one run: the cell and what `setup` adds to it.

    All errors and noise are drawn from `seed`; equal arguments give equal bits.
    """

    def __init__(
        self,
        cell: CableCell,
        gravity: Gravity,
        seed: int,
        setup: SceneSetup = NOTHING_ADDED,
        renderer: RendererName = "software",
        gui: bool = False,
        parameters: WorldParameters = WorldParameters(),
    ) -> None:
        self.cell, self.gravity, self._parameters = cell, gravity, parameters
        self.client: int = p.connect(p.GUI if gui else p.DIRECT)
        self._disconnect = weakref.finalize(self, p.disconnect, self.client)  # also if nobody closes the world
        self._step_rate = cell.hidden.step_rate
        self.step_seconds = 1.0 / self._step_rate
        self._steps = 0
        self._simulating = 0.0  # s of wall time in PyBullet's steps since `advance` began
        self._next_exposure = 0.0  # the step at which a camera exposes next
        errors_rng, light_rng = (np.random.default_rng(s) for s in np.random.SeedSequence([seed, 1]).spawn(2))
        configure(self.client, cell.hidden, gravity)
        self.boxes = build_boxes(self.client, cell.known, setup.obstacles)
        self._props = build_props(self.client, setup.props)
        self.arms = self._build_arms(errors_rng)
        self.cable = self._build_cable()
        self._named = filter_collisions(
            self.client, cell.known, self.boxes, {arm.body: name for name, arm in self.arms.items()}, self.cable
        )
        self.socket = self._plug(setup.connector_at)
        self.clip = self._build_clip()
        self.contact_peaks: dict[str, float] = {}
        self._connector = self.cable.connector_state()
        self.visuals = Visuals(self.client)
        self.renderer = make_renderer(self.visuals, renderer)
        self.light = self._draw_light(light_rng)
        self.cameras = self._build_cameras(seed, errors_rng)
        rngs = (np.random.default_rng(s) for s in np.random.SeedSequence([seed, 2]).spawn(len(setup.faults)))
        self.faults = [
            ScheduledFault(fault, effect_of(fault, self, rng, parameters.fault))
            for fault, rng in zip(setup.faults, rngs, strict=True)
        ]
        self._triggers = TriggerState()
        self._start = (
            cell.known.cable.socket(PLUGGED_INTO).world_from_plug(cell.known.cable.connector.length).translation
        )
        self._way = cell.known.cable.clip.world_from_seat.translation - self._start
        self._way_sq = float(self._way @ self._way)
        self._phase = PhaseWatch(self._start, parameters.phase)
        for arm in self.arms.values():
            arm.restart_clock()
        self._watch_faults()
        self._expose()

    def now(self) -> float:
        """Seconds since the run began."""
        return self._steps * self.step_seconds

    @counts_as("step loop")
    def advance(self, seconds: float) -> None:
        """Run the physics for so long, rounded to whole steps."""
        self._simulating = 0.0
        for _ in range(round(seconds / self.step_seconds)):
            self._step()
        move_time("physics", self._simulating)

    def note_entered(self, node: str) -> None:
        """Note that the node with this tree path was entered now, for faults that wait for it."""
        self._triggers.nodes.setdefault(node, self.now())

    def place_obstacle(self, name: str, center: FloatArray) -> None:
        """Move an obstacle that has no stand: the centre of its box to `center` (3,) m."""
        body = self.boxes[f"obstacle {name}"]
        turn = p.getBasePositionAndOrientation(body, physicsClientId=self.client)[1]
        p.resetBasePositionAndOrientation(body, center.tolist(), turn, physicsClientId=self.client)

    def place_prop(self, number: int, pose: RigidTransform | None) -> None:
        """Put prop `number` at `pose`, world_from_prop, or with None out of sight."""
        at = OUT_OF_SIGHT if pose is None else pose
        turn = at.rotation.as_quat().tolist()
        p.resetBasePositionAndOrientation(
            self._props[number], at.translation.tolist(), turn, physicsClientId=self.client
        )

    def set_light(self, light: LightState) -> None:
        """Change the light for all later exposures."""
        self.light = light
        for camera in self.cameras.values():
            camera.light = light

    def close(self) -> None:
        """Close the renderer and disconnect the client."""
        self.renderer.close()
        self._disconnect()

    def pads_touching(self, arm: str) -> tuple[bool, bool]:
        """Whether the left and the right pad of that arm touch the connector now."""
        body, link, client = self.cable.body, self.cable.connector_link, self.client
        hand = self.arms[arm]
        left, right = (
            bool(p.getContactPoints(hand.body, body, pad, link, physicsClientId=client)) for pad in hand.gripper.pads
        )
        return left, right

    def connector_pose(self) -> RigidTransform:
        """True world_from_connector after the last step."""
        return self._connector.pose

    def connector_position(self) -> Sequence[float]:
        """True position (3,) m of the connector's centre."""
        return self._connector.position

    def connector_velocity(self) -> FloatArray:
        """True velocity (3,) m/s of the connector's centre."""
        return np.array(self._connector.velocity)

    def _step(self) -> None:
        for arm in self.arms.values():
            arm.step()
        now = self.now()
        for fault in self.faults:
            fault.step(now)
        self.cable.apply_springs()
        self.clip.step(self._connector)
        began = time.perf_counter()
        p.stepSimulation(physicsClientId=self.client)
        self._simulating += time.perf_counter() - began
        self._steps += 1
        self._connector = self.cable.connector_state()
        self.socket.step()
        if self._steps % self._parameters.contact_interval == 0:
            self._watch_contacts()
            self._watch_faults()
        self._expose()

    def _watch_faults(self) -> None:
        self._triggers.now = self.now()
        if any(fault.waiting for fault in self.faults):
            self._update_triggers()
        for fault in self.faults:
            fault.watch(self._triggers)

    def _update_triggers(self) -> None:
        position, plugged = np.array(self._connector.position), self.socket.holds
        pads = (False, False) if plugged else self.pads_touching("right")
        speed = math.hypot(*self._connector.velocity)
        self._phase.step(self.now(), position, speed, pads, plugged, self.clip.holds)
        held = all(pads) and not plugged
        self._triggers.shares["carried"] = float((position - self._start) @ self._way) / self._way_sq if held else None
        self._triggers.phases = self._phase.began

    def _expose(self) -> None:
        if self._steps < self._next_exposure:
            return
        steps, rate = self._steps, self._step_rate
        poses = self.visuals.deferred_snapshot()
        for camera in self.cameras.values():
            if steps * camera.rate % rate < camera.rate:
                camera.expose(poses)
        # The next step on which any camera has exposed once more.
        following = (-(-(steps * c.rate // rate + 1) * rate // c.rate) for c in self.cameras.values())
        self._next_exposure = min(following, default=math.inf)

    def _watch_contacts(self) -> None:
        """Update the largest normal force of each arm against each body that it must not touch."""
        for name, arm in self.arms.items():
            sums: dict[str, float] = {}
            for contact in p.getContactPoints(arm.body, physicsClientId=self.client):
                other = self._named.get(contact[2] if contact[1] == arm.body else contact[1])
                if other is not None and other != name:
                    sums[other] = sums.get(other, 0.0) + contact[9]
            for other, force in sums.items():
                key = f"{name} arm - {other}"
                self.contact_peaks[key] = max(self.contact_peaks.get(key, 0.0), force)

    def _build_arms(self, rng: np.random.Generator) -> dict[str, SimArm]:
        arm, gripper = self._parameters.arm, self._parameters.gripper
        return {
            spec.name: SimArm(self.client, self.cell, spec.name, rng, arm, gripper) for spec in self.cell.known.arms
        }

    def _build_cable(self) -> CableBody:
        hidden = self.cell.hidden
        stiffness = hidden.cable.stiffness.zero if self.gravity == "zero" else hidden.cable.stiffness.earth
        cable = build_cable(
            self.client,
            hidden.cable,
            self.cell.known.cable.connector,
            hidden.cable.connector_mass,
            stiffness,
            self.step_seconds,
            self._parameters.cable,
        )
        p.changeDynamics(
            cable.body,
            cable.connector_link,
            lateralFriction=hidden.cable.connector_friction,
            spinningFriction=self._parameters.spinning_friction,
            physicsClientId=self.client,
        )
        return cable

    def _plug(self, stand: RigidTransform | None) -> SocketHold:
        """Lay the straight cable into its socket or on the stand at that pose, before the run's time begins."""
        known = self.cell.known
        socket = known.cable.socket(known.cable.plugged_into)
        goal = socket.world_from_plug(known.cable.connector.length) if stand is None else stand
        hold = lay_cable(self.client, self.cable, goal, self.step_seconds, self._parameters.laying)
        if stand is None:
            return SocketHold(hold, np.asarray(socket.axis), socket.pull_out_force)
        return SocketHold(hold, None, self._parameters.stand_force)

    def _build_clip(self) -> ClipHold:
        return ClipHold(
            BodyLink(self.client, self.cable.body, self.cable.connector_link),
            self.cell.known.cable.clip,
            self.cell.hidden.cable.connector_mass,
            self.cable.connector_inertia,
            self.step_seconds,
            self._parameters.clip,
        )

    def _draw_light(self, rng: np.random.Generator) -> LightState:
        light = self.cell.hidden.light
        turn = Rotation.from_rotvec(np.deg2rad(light.direction_jitter_deg) * rng.normal(size=3) / np.sqrt(3))
        factor = max(self._parameters.smallest_brightness, 1.0 + light.brightness_jitter * float(rng.normal()))
        direction = turn.apply(np.asarray(light.direction) / np.linalg.norm(light.direction))
        return LightState(direction, light.ambient * factor, light.diffuse * factor)

    def _build_cameras(self, seed: int, rng: np.random.Generator) -> dict[str, SimCamera]:
        known, errors = self.cell.known, self.cell.hidden.errors
        cameras: dict[str, SimCamera] = {}
        for spec in known.cameras:
            error = camera_error(errors, rng)
            mount = spec.mount
            if isinstance(mount, WristMount):
                mounting = _wrist_mounting(self.arms[mount.arm], mount, error)
            else:
                mounting = _fixed_mounting(mount.world_from_camera * error)
            cameras[spec.name] = SimCamera(
                spec=spec,
                renderer=self.renderer,
                light=self.light,
                noise=DepthNoise(spec, errors, seed, self._parameters.depth_noise),
                mounting=mounting,
                now=self.now,
                latency=known.latencies.image,
            )
        return cameras


def _wrist_mounting(arm: SimArm, mount: WristMount, error: RigidTransform) -> CameraMounting:
    def expose() -> Callable[[], RigidTransform]:
        wrist = arm.deferred_wrist_pose()
        return lambda: wrist() * mount.wrist_from_camera * error

    return CameraMounting(expose, lambda: arm.reading().positions)


def _fixed_mounting(world_from_camera: RigidTransform) -> CameraMounting:
    return CameraMounting(lambda: lambda: world_from_camera)
