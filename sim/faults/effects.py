"""What each fault does to the world's parts. The parts themselves hold the models: jaw, camera, arm."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import pybullet as p
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces import fault as f
from regrasp.sim.cable.cable import CableBody
from regrasp.sim.cameras.camera import SimCamera
from regrasp.sim.render.renderer import LightState
from regrasp.sim.robot.arm import SimArm

KNOCK_SECONDS = 0.02  # s over which a knock's impulse is shared


class Breakable(Protocol):
    """What faults need of a world."""

    client: int
    step_seconds: float
    arms: dict[str, SimArm]
    cameras: dict[str, SimCamera]
    cable: CableBody
    boxes: dict[str, int]
    light: LightState

    def set_light(self, light: LightState) -> None:
        """Change the light."""

    def connector_pose(self) -> RigidTransform:
        """World_from_connector."""


def _nothing(*_: float) -> None:
    pass


@dataclass
class Effect:
    """`begin` and `end` switch a fault on and off; `step` acts before each physics step with the seconds since.

    `seconds` is how long it takes when that is its own nature, None when the scenario says so.
    """

    begin: Callable[[], None] = _nothing
    end: Callable[[], None] = _nothing
    step: Callable[[float], None] = _nothing
    seconds: float | None = None


def effect_of(fault: f.AnyFault, world: Breakable, rng: np.random.Generator) -> Effect:
    """The effect of a drawn fault on a world; none for a fault of the robot's software. `rng` is the fault's own."""
    jaw = world.arms["right"].gripper
    match fault:
        case f.JawOpens():
            return Effect(lambda: jaw.set_fault(forced_open=True), lambda: jaw.set_fault(forced_open=False))
        case f.JawWeakens():
            share = fault.force_share
            return Effect(lambda: jaw.set_fault(force_share=share), lambda: jaw.set_fault(force_share=1.0))
        case f.JawStuck():
            return Effect(lambda: jaw.set_fault(stuck=True), lambda: jaw.set_fault(stuck=False))
        case f.CameraFault():
            return _camera(fault, world, rng)
        case f.LightChanges():
            return _light(fault, world)
        case f.JointFault():
            return _joint(fault, world)
        case f.ObstacleMovesIn():
            return _obstacle(fault, world)
        case f.ConnectorKnocked():
            return _knock(fault, world)
        case f.CableSnags():
            return _snag(fault, world)
    return Effect()


def _camera(fault: f.CameraFault, world: Breakable, rng: np.random.Generator) -> Effect:
    camera = world.cameras[fault.camera]

    def switch(name: str, on: object, off: object) -> Effect:
        return Effect(lambda: setattr(camera, name, on), lambda: setattr(camera, name, off))

    match fault:
        case f.CameraDrops():
            share = fault.share
            return switch("drops", lambda: bool(rng.random() < share), None)
        case f.CameraFreezes():
            return switch("frozen", True, False)
        case f.CameraDark():
            return switch("covered", True, False)
    return switch("depthless", True, False)


def _light(fault: f.LightChanges, world: Breakable) -> Effect:
    before = world.light
    direction = before.direction if fault.direction is None else fault.direction
    after = LightState(direction, before.ambient * fault.factor, before.diffuse * fault.factor)
    return Effect(lambda: world.set_light(after), lambda: world.set_light(before))


def _joint(fault: f.JointFault, world: Breakable) -> Effect:
    arm, joint = world.arms[fault.arm], f.JOINT_NAMES.index(fault.joint)
    if isinstance(fault, f.EncoderJumps):
        angle = fault.angle
        return Effect(lambda: arm.slip_encoder(joint, angle))
    share = fault.speed_share if isinstance(fault, f.JointLags) else 0.0
    return Effect(lambda: arm.set_speed_share(joint, share), lambda: arm.set_speed_share(joint, 1.0))


def _obstacle(fault: f.ObstacleMovesIn, world: Breakable) -> Effect:
    names = (f"obstacle {fault.obstacle}", f"obstacle {fault.obstacle} stand")
    bodies = [world.boxes[name] for name in names if name in world.boxes]
    poses = [p.getBasePositionAndOrientation(body, physicsClientId=world.client) for body in bodies]
    way = np.array(fault.by)
    seconds = max(float(np.linalg.norm(way)) / fault.speed, world.step_seconds)

    def place(since: float, moving: bool = True) -> None:
        share = min(1.0, since / seconds)
        for body, (start, turn) in zip(bodies, poses, strict=True):
            at = (np.array(start) + share * way).tolist()
            p.resetBasePositionAndOrientation(body, at, turn, physicsClientId=world.client)
            p.resetBaseVelocity(body, (way / seconds * moving).tolist(), [0, 0, 0], physicsClientId=world.client)

    return Effect(end=lambda: place(seconds, moving=False), step=place, seconds=seconds)


def _knock(fault: f.ConnectorKnocked, world: Breakable) -> Effect:
    force = (np.array(fault.impulse) / KNOCK_SECONDS).tolist()
    cable = world.cable

    def push(_: float) -> None:
        at = world.connector_pose().translation.tolist()
        p.applyExternalForce(cable.body, cable.connector_link, force, at, p.WORLD_FRAME, physicsClientId=world.client)

    return Effect(step=push, seconds=KNOCK_SECONDS)


def _snag(fault: f.CableSnags, world: Breakable) -> Effect:
    cable, client = world.cable, world.client
    link = round(fault.along * (cable.links - 1))
    caught: list[np.ndarray] = []

    def position() -> np.ndarray:
        return np.array(p.getLinkState(cable.body, link, 0, 1, physicsClientId=client)[0])

    def pull(_: float) -> None:
        at = position()
        force = fault.stiffness * (caught[0] - at)
        size = float(np.linalg.norm(force))
        force *= min(1.0, fault.max_force / size) if size > 0 else 0.0
        p.applyExternalForce(cable.body, link, force.tolist(), at.tolist(), p.WORLD_FRAME, physicsClientId=client)

    return Effect(begin=lambda: caught.append(position()), step=pull)
