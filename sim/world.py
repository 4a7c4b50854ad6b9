"""The world: one PyBullet client with the cell, the arms, the cable, the cameras and the faults of one run.

Time moves only in `advance`. Every physics step runs the same schedule: servos, cable springs, step, holds, faults,
contacts; camera exposures and finger samples fall on fixed steps, so nothing depends on who looks or how often.
"""

from collections.abc import Callable

import numpy as np
import pybullet as p
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cell import Cell, WristMount
from regrasp.interfaces.fault import AnyFault
from regrasp.interfaces.scene import Gravity, Obstacle, Prop
from regrasp.sim.build import OUT_OF_SIGHT, build_boxes, build_props, configure, filter_collisions, lay_cable
from regrasp.sim.cable.cable import CableBody, build_cable
from regrasp.sim.cable.fixtures import STAND_FORCE, ClipHold, SocketHold
from regrasp.sim.cable.phase import PhaseWatch
from regrasp.sim.cameras.camera import SimCamera, camera_error
from regrasp.sim.cameras.depth_noise import DepthNoise
from regrasp.sim.faults.effects import effect_of
from regrasp.sim.faults.faults import Fault, Moments
from regrasp.sim.render.renderer import LightState, RendererName, make_renderer
from regrasp.sim.render.visuals import Visuals
from regrasp.sim.robot.arm import SimArm

FloatArray = NDArray[np.float64]
CONTACT_EVERY = 4  # physics steps between looks at the arms' contacts


class World:
    """One run's world. `seed` draws every error and noise; the same arguments give the same bits.

    `connector_at` is where the connector starts, world_from_connector, on a stand instead of in its socket; `props` lie
    out of sight until they are placed.
    """

    def __init__(
        self,
        cell: Cell,
        gravity: Gravity,
        seed: int,
        obstacles: tuple[Obstacle, ...] = (),
        faults: tuple[AnyFault, ...] = (),
        renderer: RendererName = "auto",
        gui: bool = False,
        connector_at: RigidTransform | None = None,
        props: tuple[Prop, ...] = (),
    ) -> None:
        self.cell, self.gravity = cell, gravity
        self.client: int = p.connect(p.GUI if gui else p.DIRECT)
        self.step_seconds = 1.0 / cell.hidden.step_rate
        self._steps = 0
        errors_rng, light_rng = (np.random.default_rng(s) for s in np.random.SeedSequence([seed, 1]).spawn(2))
        configure(self.client, cell.hidden, gravity)
        self.boxes = build_boxes(self.client, cell.known, obstacles)
        self._props = build_props(self.client, props)
        self.arms = self._build_arms(errors_rng)
        self.cable = self._build_cable()
        self._named = filter_collisions(
            self.client, cell.known, self.boxes, {arm.body: name for name, arm in self.arms.items()}, self.cable
        )
        self.socket = self._plug(connector_at)
        self.clip = self._build_clip()
        self.contact_peaks: dict[str, float] = {}
        self._connector, self._velocity, self._rate = self.cable.connector_state()
        self.visuals = Visuals(self.client)
        self.renderer = make_renderer(self.visuals, renderer)
        self.light = self._draw_light(light_rng)
        self.cameras = self._build_cameras(seed, errors_rng)
        rngs = (np.random.default_rng(s) for s in np.random.SeedSequence([seed, 2]).spawn(len(faults)))
        self.faults = [Fault(f, effect_of(f, self, rng)) for f, rng in zip(faults, rngs, strict=True)]
        self._moments = Moments()
        known = cell.known
        self._start = known.socket(known.plugged_into).world_from_plug(known.connector.length).translation
        self._phase = PhaseWatch(self._start)
        for arm in self.arms.values():
            arm.restart_clock()
        self._watch_faults()
        self._expose()

    def now(self) -> float:
        """Seconds since the run began."""
        return self._steps * self.step_seconds

    def advance(self, seconds: float) -> None:
        """Let the world run for so long (rounded to whole physics steps)."""
        for _ in range(round(seconds / self.step_seconds)):
            self._step()

    def notice(self, node: str) -> None:
        """Take note that the node of this tree path was entered now: a fault may wait for it."""
        self._moments.nodes.setdefault(node, self.now())

    def place_obstacle(self, name: str, center: FloatArray) -> None:
        """Put an obstacle's box, which has no stand, elsewhere: its middle at `center` (3,) m."""
        body = self.boxes[f"obstacle {name}"]
        turn = p.getBasePositionAndOrientation(body, physicsClientId=self.client)[1]
        p.resetBasePositionAndOrientation(body, center.tolist(), turn, physicsClientId=self.client)

    def place_prop(self, number: int, pose: RigidTransform | None) -> None:
        """Put the prop of that number at `pose`, world_from_prop, or out of sight."""
        at = OUT_OF_SIGHT if pose is None else pose
        turn = at.rotation.as_quat().tolist()
        p.resetBasePositionAndOrientation(
            self._props[number], at.translation.tolist(), turn, physicsClientId=self.client
        )

    def set_light(self, light: LightState) -> None:
        """Light the cell so from now on."""
        self.light = light
        for camera in self.cameras.values():
            camera.light = light

    def close(self) -> None:
        """Free the client and the renderer."""
        self.renderer.close()
        p.disconnect(self.client)

    def pads_touching(self, arm: str) -> tuple[bool, bool]:
        """Whether the left and the right pad of an arm touch the connector now."""
        body, link, client = self.cable.body, self.cable.connector_link, self.client
        hand = self.arms[arm]
        left, right = (
            bool(p.getContactPoints(hand.body, body, pad, link, physicsClientId=client)) for pad in hand.gripper.pads
        )
        return left, right

    def connector_pose(self) -> RigidTransform:
        """True world_from_connector after the last step."""
        return self._connector

    def connector_velocity(self) -> FloatArray:
        """True velocity (3,) m/s of the connector's centre."""
        return self._velocity

    def _step(self) -> None:
        for arm in self.arms.values():
            arm.step()
        for fault in self.faults:
            fault.step(self.now())
        self.cable.apply_springs()
        self.clip.step(self._connector, self._velocity, self._rate)
        p.stepSimulation(physicsClientId=self.client)
        self._steps += 1
        self._connector, self._velocity, self._rate = self.cable.connector_state()
        self.socket.step()
        if self._steps % CONTACT_EVERY == 0:
            self._watch_contacts()
            self._watch_faults()
        self._expose()

    def _watch_faults(self) -> None:
        self._moments.now = self.now()
        if any(fault.waiting for fault in self.faults):
            self._look_at_moments()
        for fault in self.faults:
            fault.watch(self._moments)

    def _look_at_moments(self) -> None:
        position, plugged = self._connector.translation, self.socket.holds
        pads = (False, False) if plugged else self.pads_touching("right")
        speed = float(np.linalg.norm(self._velocity))
        self._phase.step(self.now(), position, speed, pads, plugged, self.clip.holds)
        way = self.cell.known.clip.world_from_seat.translation - self._start
        held = all(pads) and not plugged
        self._moments.carried = float((position - self._start) @ way) / float(way @ way) if held else None
        self._moments.phases = self._phase.began

    def _expose(self) -> None:
        rate = self.cell.hidden.step_rate
        due = [c for c in self.cameras.values() if self._steps * c.spec.rate % rate < c.spec.rate]
        if due:
            poses = self.visuals.snapshot()
            for camera in due:
                camera.expose(poses)

    def _watch_contacts(self) -> None:
        """Keep the largest normal force of each arm against each thing that it must not touch."""
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
        known, hidden = self.cell.known, self.cell.hidden
        mounts = {c.mount.arm: c.mount.offset for c in known.cameras if isinstance(c.mount, WristMount)}
        return {
            spec.name: SimArm(
                self.client, spec, hidden.gripper, hidden.errors, self.step_seconds, mounts.get(spec.name), rng
            )
            for spec in known.arms
        }

    def _build_cable(self) -> CableBody:
        hidden = self.cell.hidden
        stiffness = hidden.cable.stiffness.zero if self.gravity == "zero" else hidden.cable.stiffness.earth
        cable = build_cable(
            self.client, hidden.cable, self.cell.known.connector, hidden.connector_mass, stiffness, self.step_seconds
        )
        p.changeDynamics(
            cable.body,
            cable.connector_link,
            lateralFriction=hidden.connector_friction,
            spinningFriction=0.005,
            physicsClientId=self.client,
        )
        return cable

    def _plug(self, stand: RigidTransform | None) -> SocketHold:
        """Lay the straight cable into its socket, or on a stand, and let it come to rest, before time begins."""
        known = self.cell.known
        socket = known.socket(known.plugged_into)
        goal = socket.world_from_plug(known.connector.length) if stand is None else stand
        hold = lay_cable(self.client, self.cable, goal, self.step_seconds)
        if stand is None:
            return SocketHold(hold, np.asarray(socket.axis), socket.pull_out_force)
        return SocketHold(hold, None, STAND_FORCE)

    def _build_clip(self) -> ClipHold:
        return ClipHold(
            self.client,
            self.cable.body,
            self.cable.connector_link,
            self.cell.known.clip,
            self.cell.hidden.connector_mass,
            self.cable.connector_inertia,
            self.step_seconds,
        )

    def _draw_light(self, rng: np.random.Generator) -> LightState:
        light = self.cell.hidden.light
        turn = Rotation.from_rotvec(np.deg2rad(light.direction_jitter_deg) * rng.normal(size=3) / np.sqrt(3))
        factor = max(0.3, 1.0 + light.brightness_jitter * float(rng.normal()))
        direction = turn.apply(np.asarray(light.direction) / np.linalg.norm(light.direction))
        return LightState(direction, light.ambient * factor, light.diffuse * factor)

    def _build_cameras(self, seed: int, rng: np.random.Generator) -> dict[str, SimCamera]:
        known, errors = self.cell.known, self.cell.hidden.errors
        cameras: dict[str, SimCamera] = {}
        for spec in known.cameras:
            error = camera_error(errors, rng)
            mount = spec.mount
            if isinstance(mount, WristMount):
                arm = self.arms[mount.arm]
                pose = _wrist_camera_pose(arm, mount, error)
                joints = _encoder(arm)
            else:
                pose, joints = _constant(mount.world_from_camera * error), None
            cameras[spec.name] = SimCamera(
                spec=spec,
                visuals=self.visuals,
                renderer=self.renderer,
                light=self.light,
                noise=DepthNoise(spec, errors, seed),
                true_pose=pose,
                joints=joints,
                now=self.now,
                latency=known.latencies.image,
            )
        return cameras


def _wrist_camera_pose(arm: SimArm, mount: WristMount, error: RigidTransform) -> Callable[[], RigidTransform]:
    return lambda: arm.wrist_pose() * mount.wrist_from_camera * error


def _encoder(arm: SimArm) -> Callable[[], FloatArray]:
    return lambda: arm.reading().positions


def _constant(pose: RigidTransform) -> Callable[[], RigidTransform]:
    return lambda: pose
