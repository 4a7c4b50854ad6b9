"""How the cable gets to where a run begins: its straight end is moved to the socket, and it comes to rest."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation, Slerp

from regrasp.sim.bodies import BodyLink
from regrasp.sim.cable.cable import CableBody
from regrasp.sim.engine import Engine
from regrasp.sim.hold import Hold


@dataclass(frozen=True)
class LayingParameters:
    """How the cable is laid before a run."""

    move_seconds: float = 1.5  # in which the end moves from the straight cable's tip to its start
    settle_seconds: float = 2.5  # in which the cable comes to rest


def lay_cable(
    engine: Engine, cable: CableBody, goal: RigidTransform, parameters: LayingParameters = LayingParameters()
) -> Hold:
    """Move the straight cable's connector to the pose `goal` and let the cable come to rest; returns the hold there.

    The path eases in and out by :math:`3 s^2 - 2 s^3`.
    """
    start = cable.connector_state().pose
    hold = Hold(BodyLink(engine.client, cable.body, cable.connector_link), start)
    turn = Slerp([0, 1], Rotation.concatenate([start.rotation, goal.rotation]))
    steps = round(parameters.move_seconds / engine.step_seconds)
    s = np.arange(1, steps + 1) / steps
    s = s * s * (3 - 2 * s)
    way = RigidTransform.from_components(np.outer(1 - s, start.translation) + np.outer(s, goal.translation), turn(s))
    positions, quaternions = way.translation.tolist(), way.rotation.as_quat().tolist()
    for i in range(steps + round(parameters.settle_seconds / engine.step_seconds)):
        if i < steps:
            hold.move(positions[i], quaternions[i])
        cable.apply_springs()
        engine.step()
    engine.count_wall_time()
    return hold
