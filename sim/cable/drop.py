"""Where a lost end of a cable settles: the drop by itself, without arms. Ground truth, which the robot never reads."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pybullet as p
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.scene import Gravity, Obstacle, SceneSetup
from regrasp.sim.cable.laying import LayingParameters
from regrasp.sim.cable.objects import CableObjects, CableObjectsParameters
from regrasp.sim.cable.phase import ConditionTimer
from regrasp.sim.engine import Engine
from regrasp.sim.scene import Scene


@dataclass(frozen=True)
class DropParameters:
    """How the drop is simulated."""

    # s in which the end is brought to where it is lost, and comes to rest there; choice: the drop starts from rest
    laying: LayingParameters = field(default_factory=lambda: LayingParameters(0.6, 0.4))
    still_speed: float = 0.01  # m/s; an end no faster than this ...
    still_seconds: float = 0.3  # ... for so long has settled
    looks: int = 12  # physics steps between two looks at the speed
    max_seconds: float = 12.0  # of the drop; a zero-gravity swing lasts 8


@dataclass(frozen=True, eq=False)
class SettledEnd:
    """A lost end at rest: world_from_connector, and the points (n + 1, 3) m between the cable's links."""

    connector: RigidTransform
    cable: FloatArray


def settled_end(
    cell: CableCell,
    gravity: Gravity,
    obstacles: Sequence[Obstacle],
    lost_at: RigidTransform,
    parameters: DropParameters = DropParameters(),
) -> SettledEnd | None:
    """Where the end settles that is let go at rest with the connector at `lost_at`; None if it goes on swinging."""
    engine = Engine(cell.hidden, gravity)
    try:
        objects = CableObjects(cell, lost_at, CableObjectsParameters(laying=parameters.laying))
        scene = Scene(engine, cell.known, objects, SceneSetup(tuple(obstacles)))
        objects.build_moving(engine, {})
        objects.lay_out(engine, scene.fixed_bodies)
        objects.socket.release()
        engine.restart_clock()
        return _settled(engine, objects, parameters)
    finally:
        engine.close()


def _settled(engine: Engine, objects: CableObjects, parameters: DropParameters) -> SettledEnd | None:
    still = ConditionTimer()
    while engine.now() < parameters.max_seconds:
        for _ in range(parameters.looks):
            objects.before_step()
            engine.step()
            objects.after_step()
        slow = float(np.linalg.norm(objects.connector_velocity())) <= parameters.still_speed
        if still.update(engine.now(), slow) >= parameters.still_seconds:
            return SettledEnd(objects.connector_pose(), _points(objects))
    return None


def _points(objects: CableObjects) -> FloatArray:
    cable = objects.cable
    joints = [p.getLinkState(cable.body, n, 0, 1, physicsClientId=cable.client)[4] for n in range(cable.links)]
    rear = objects.connector_pose().apply([-0.5 * objects.cell.known.cable.connector.length, 0.0, 0.0])
    return np.vstack([joints, rear])
