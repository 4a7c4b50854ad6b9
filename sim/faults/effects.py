"""Effects of the faults on the world's parts. The models of faulty grippers, cameras and arms are in those parts."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import pybullet as p

from regrasp.interfaces import fault as f
from regrasp.sim.cameras.camera import SimCamera
from regrasp.sim.render.renderer import LightState
from regrasp.sim.robot.arm import SimArm


@dataclass(frozen=True)
class FaultParameters:
    """Numbers of faults that the scenario file does not give."""

    cover_transmission: float = 0.02  # share of the light that passes a covered lens; the fault's description quotes it


class FaultTarget(Protocol):
    """The parts of a world that faults act on. `fixed_bodies` are PyBullet's ids by name, such as `obstacle NAME`."""

    client: int
    step_seconds: float
    arms: dict[str, SimArm]
    cameras: dict[str, SimCamera]
    fixed_bodies: dict[str, int]

    @property
    def light(self) -> LightState:
        """The present light."""
        ...

    def set_light(self, light: LightState) -> None:
        """Change the light."""


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


# What makes the effect of a task's own fault: from the fault with its ranges drawn, the world, and a generator that
# belongs to this fault alone. By the fault's class.
TaskEffects = Mapping[type[f.Fault], Callable[[Any, FaultTarget, np.random.Generator], Effect]]


def effect_of(
    fault: f.Fault,
    world: FaultTarget,
    rng: np.random.Generator,
    of_task: TaskEffects,
    parameters: FaultParameters = FaultParameters(),
) -> Effect:
    """The effect on the world of a fault whose ranges are drawn; none for a fault of the robot's software.

    `rng` belongs to this fault alone; `of_task` are the effects of the task's own faults.

    Raises:
        KeyError: the fault names an arm or a camera that the world does not have.
    """
    for kind in type(fault).__mro__:  # a scenario's fault is of a class derived from the task's
        if kind in of_task:
            return of_task[kind](fault, world, rng)
    match fault:
        case f.JawFault():
            return _jaw(fault, world)
        case f.CameraFault():
            return _camera(fault, world, rng, parameters.cover_transmission)
        case f.LightChanges():
            return _light(fault, world)
        case f.JointFault():
            return _joint(fault, world)
        case f.ObstacleMovesIn():
            return _obstacle(fault, world)
    return Effect()


def _jaw(fault: f.JawFault, world: FaultTarget) -> Effect:
    jaw = world.arms[fault.arm].gripper
    match fault:
        case f.JawOpens():
            return Effect(lambda: jaw.set_fault(forced_open=True), lambda: jaw.set_fault(forced_open=False))
        case f.JawWeakens():
            share = fault.force_share
            return Effect(lambda: jaw.set_fault(force_share=share), lambda: jaw.set_fault(force_share=1.0))
    return Effect(lambda: jaw.set_fault(stuck=True), lambda: jaw.set_fault(stuck=False))


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
    arm = world.arms[fault.arm]
    joint = arm.robot.joint_names.index(fault.joint)
    if isinstance(fault, f.EncoderJumps):
        angle = fault.angle
        return Effect(lambda: arm.slip_encoder(joint, angle))
    share = fault.speed_share if isinstance(fault, f.JointLags) else 0.0
    return Effect(lambda: arm.set_speed_share(joint, share), lambda: arm.set_speed_share(joint, 1.0))


def _obstacle(fault: f.ObstacleMovesIn, world: FaultTarget) -> Effect:
    names = (f"obstacle {fault.obstacle}", f"obstacle {fault.obstacle} stand")
    bodies = [world.fixed_bodies[name] for name in names if name in world.fixed_bodies]
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
