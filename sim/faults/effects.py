"""Effects of the faults on the world's parts. The models of faulty grippers, cameras and arms are in those parts."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import pybullet as p
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces import fault as f
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.fault import CableSnags, ConnectorKnocked
from regrasp.sim.cable.cable import CableBody
from regrasp.sim.cameras.camera import SimCamera
from regrasp.sim.render.renderer import LightState
from regrasp.sim.robot.arm import SimArm


@dataclass(frozen=True)
class FaultParameters:
    """Numbers of faults that the scenario file does not give."""

    knock_seconds: float = 0.02  # s over which a knock's impulse is spread
    cover_transmission: float = 0.02  # share of the light that passes a covered lens; the fault's description quotes it


class FaultTarget(Protocol):
    """The parts of a world that faults act on."""

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
        """True pose world_from_connector."""


def _nothing(*_: float) -> None:
    pass


@dataclass
class Effect:
    """A fault's actions: `begin` and `end` switch it on and off, `step` acts before each physics step.

    `step` takes the seconds since the beginning. `seconds` is the duration of a fault that has one of its own; it is
    None where the scenario gives the duration.
    """

    begin: Callable[[], None] = _nothing
    end: Callable[[], None] = _nothing
    step: Callable[[float], None] = _nothing
    seconds: float | None = None


def effect_of(
    fault: f.Fault,
    world: FaultTarget,
    rng: np.random.Generator,
    parameters: FaultParameters = FaultParameters(),
) -> Effect:
    """The effect on the world of a fault whose ranges are drawn; no effect for a fault of the robot's software.

    `rng` belongs to this fault alone.
    """
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
            return _camera(fault, world, rng, parameters.cover_transmission)
        case f.LightChanges():
            return _light(fault, world)
        case f.JointFault():
            return _joint(fault, world)
        case f.ObstacleMovesIn():
            return _obstacle(fault, world)
        case ConnectorKnocked():
            return _knock(fault, world, parameters.knock_seconds)
        case CableSnags():
            return _snag(fault, world)
    return Effect()


def _camera(fault: f.CameraFault, world: FaultTarget, rng: np.random.Generator, cover_transmission: float) -> Effect:
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
            return switch("transmission", cover_transmission, 1.0)
    return switch("without_depth", True, False)


def _light(fault: f.LightChanges, world: FaultTarget) -> Effect:
    before = world.light
    direction = before.direction if fault.direction is None else fault.direction
    after = LightState(direction, before.ambient * fault.factor, before.diffuse * fault.factor)
    return Effect(lambda: world.set_light(after), lambda: world.set_light(before))


def _joint(fault: f.JointFault, world: FaultTarget) -> Effect:
    arm, joint = world.arms[fault.arm], f.JOINT_NAMES.index(fault.joint)
    if isinstance(fault, f.EncoderJumps):
        angle = fault.angle
        return Effect(lambda: arm.slip_encoder(joint, angle))
    share = fault.speed_share if isinstance(fault, f.JointLags) else 0.0
    return Effect(lambda: arm.set_speed_share(joint, share), lambda: arm.set_speed_share(joint, 1.0))


def _obstacle(fault: f.ObstacleMovesIn, world: FaultTarget) -> Effect:
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


def _knock(fault: ConnectorKnocked, world: FaultTarget, seconds: float) -> Effect:
    force = (np.array(fault.impulse) / seconds).tolist()
    cable = world.cable

    def push(_: float) -> None:
        at = world.connector_pose().translation.tolist()
        p.applyExternalForce(cable.body, cable.connector_link, force, at, p.WORLD_FRAME, physicsClientId=world.client)

    return Effect(step=push, seconds=seconds)


def _snag(fault: CableSnags, world: FaultTarget) -> Effect:
    cable, client = world.cable, world.client
    link = round(fault.along * (cable.links - 1))
    caught: list[FloatArray] = []

    def position() -> FloatArray:
        return np.array(p.getLinkState(cable.body, link, 0, 1, physicsClientId=client)[0])

    def pull(_: float) -> None:
        at = position()
        force = fault.stiffness * (caught[0] - at)
        size = float(np.linalg.norm(force))
        force *= min(1.0, fault.max_force / size) if size > 0 else 0.0
        p.applyExternalForce(cable.body, link, force.tolist(), at.tolist(), p.WORLD_FRAME, physicsClientId=client)

    return Effect(begin=lambda: caught.append(position()), step=pull)
