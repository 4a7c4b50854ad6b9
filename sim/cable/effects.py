"""Effects of the cable task's own faults."""

from functools import partial

import numpy as np
import pybullet as p

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.fault import CableSnags, ConnectorKnocked
from regrasp.sim.cable.cable import CableBody
from regrasp.sim.faults.effects import Effect, FaultTarget, TaskEffects


def effects_on(cable: CableBody, knock_seconds: float) -> TaskEffects:
    """The effects of the task's faults on that cable. `knock_seconds` is the time over which a knock is spread."""
    return {ConnectorKnocked: partial(_knock, cable, knock_seconds), CableSnags: partial(_snag, cable)}


def _knock(
    cable: CableBody, seconds: float, fault: ConnectorKnocked, world: FaultTarget, _: np.random.Generator
) -> Effect:
    force = (np.array(fault.impulse) / seconds).tolist()

    def push(_: float) -> None:
        at = cable.connector_state().position
        p.applyExternalForce(cable.body, cable.connector_link, force, at, p.WORLD_FRAME, physicsClientId=world.client)

    return Effect(step=push, seconds=seconds)


def _snag(cable: CableBody, fault: CableSnags, world: FaultTarget, _: np.random.Generator) -> Effect:
    client, link = world.client, round(fault.along * (cable.links - 1))
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
