"""Builds a world: physics settings, fixed bodies, collision filters, and the cable in its socket."""

import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pybullet as p
from scipy.spatial.transform import RigidTransform, Rotation, Slerp

from regrasp.interfaces.cable.cell import CableKnown, Socket
from regrasp.interfaces.cell import Box
from regrasp.interfaces.hidden_world import HiddenWorld
from regrasp.interfaces.scene import EARTH_GRAVITY, Gravity, Obstacle, Prop
from regrasp.interfaces.wall_time import move_time
from regrasp.sim.cable.cable import CableBody
from regrasp.sim.cable.fixtures import BodyLink, Hold
from regrasp.sim.render.fiducials import compound_visual, tag_boxes

# Where bodies are that nobody shall see: below the floor, and near, since the shadow map must span all bodies.
OUT_OF_SIGHT = RigidTransform.from_translation([0.2, 0.0, -0.4])


@dataclass(frozen=True)
class LayingParameters:
    """How the cable is laid before a run."""

    move_seconds: float = 1.5  # in which the end moves from the straight cable's tip to its start
    settle_seconds: float = 2.5  # in which the cable comes to rest


def configure(client: int, hidden: HiddenWorld, gravity: Gravity) -> None:
    """Empty the client and set its gravity, step and solver."""
    p.resetSimulation(physicsClientId=client)
    p.setGravity(0, 0, -EARTH_GRAVITY if gravity == "earth" else 0.0, physicsClientId=client)
    p.setTimeStep(1.0 / hidden.step_rate, physicsClientId=client)
    p.setPhysicsEngineParameter(
        numSolverIterations=hidden.solver_iterations, deterministicOverlappingPairs=1, physicsClientId=client
    )


def build_boxes(
    client: int, known: CableKnown, obstacles: tuple[Obstacle, ...], friction: float = 0.5
) -> dict[str, int]:
    """Create all fixed bodies; returns their ids by name: floor, panels, clip bracket, sockets, `obstacle NAME`.

    `friction` is their coefficient.
    """
    bodies = {box.name: _box(client, box, friction) for box in (*known.boxes, *known.cable.clip.bracket)}
    bodies |= {socket.name: _socket_block(client, socket, friction) for socket in known.cable.sockets}
    if known.cable.clip.tag is not None:
        world_from_tag = known.cable.clip.world_from_seat * known.cable.clip.tag.body_from_tag
        p.createMultiBody(
            0, -1, compound_visual(client, tag_boxes(known.cable.clip.tag), world_from_tag), physicsClientId=client
        )
    for obstacle in obstacles:
        turn = Rotation.from_euler("z", obstacle.yaw)
        for box in (obstacle.box, obstacle.stand):
            if box is not None:
                bodies[f"obstacle {box.name}"] = _box(client, box, friction, turn)
    return bodies


def build_props(client: int, props: tuple[Prop, ...]) -> list[int]:
    """Create visual bodies, out of sight; returns their ids."""
    return [_prop(client, prop) for prop in props]


def filter_collisions(
    client: int,
    known: CableKnown,
    boxes: Mapping[str, int],
    arms: Mapping[int, str],
    cable: CableBody,
    clamped_links: int = 4,
) -> dict[int, str]:
    """Switch off collisions of pairs that touch by design.

    These are the arms' bases and the floor; the connector with sockets and clip; and the first `clamped_links` links at
    the cable's fixed end with the socket and the panel through which they run. `arms` gives the names of the arms'
    bodies. Returns the names of the bodies that an arm must not touch: all but the cable, the sockets and the clip.
    """
    holders = [s.name for s in known.cable.sockets] + [b.name for b in known.cable.clip.bracket]
    pairs = [(arm, -1, boxes["floor"]) for arm in arms if "floor" in boxes]
    pairs += [(cable.body, cable.connector_link, boxes[name]) for name in holders]
    clamp = [boxes[name] for name in (known.cable.sockets[-1].name, "right_panel") if name in boxes]
    pairs += [(cable.body, link, box) for link in range(clamped_links) for box in clamp]
    for body, link, box in pairs:
        p.setCollisionFilterPair(body, box, link, -1, 0, physicsClientId=client)
    return {body: name for name, body in boxes.items() if name not in holders} | dict(arms)


def lay_cable(
    client: int,
    cable: CableBody,
    goal: RigidTransform,
    step: float,
    parameters: LayingParameters = LayingParameters(),
) -> Hold:
    """Move the straight cable's connector to the pose `goal` and let the cable come to rest; returns the hold there.

    The path eases in and out by :math:`3 s^2 - 2 s^3`. `step` is the physics step in s.
    """
    start = cable.connector_state().pose
    hold = Hold(BodyLink(client, cable.body, cable.connector_link), start)
    turn = Slerp([0, 1], Rotation.concatenate([start.rotation, goal.rotation]))
    steps = round(parameters.move_seconds / step)
    s = np.arange(1, steps + 1) / steps
    s = s * s * (3 - 2 * s)
    way = RigidTransform.from_components(np.outer(1 - s, start.translation) + np.outer(s, goal.translation), turn(s))
    positions, quaternions = way.translation.tolist(), way.rotation.as_quat().tolist()
    simulating = 0.0
    for i in range(steps + round(parameters.settle_seconds / step)):
        if i < steps:
            hold.move(positions[i], quaternions[i])
        cable.apply_springs()
        began = time.perf_counter()
        p.stepSimulation(physicsClientId=client)
        simulating += time.perf_counter() - began
    move_time("physics", simulating)
    return hold


def _box(client: int, box: Box, friction: float, turn: Rotation | None = None) -> int:
    half = [s / 2 for s in box.size]
    collision = p.createCollisionShape(p.GEOM_BOX, halfExtents=half, physicsClientId=client)
    visual = p.createVisualShape(p.GEOM_BOX, halfExtents=half, rgbaColor=[*box.color, 1], physicsClientId=client)
    turn = Rotation.identity() if turn is None else turn
    body = p.createMultiBody(0, collision, visual, box.center, turn.as_quat().tolist(), physicsClientId=client)
    p.changeDynamics(body, -1, lateralFriction=friction, physicsClientId=client)
    return int(body)


def _prop(client: int, prop: Prop) -> int:
    match prop.kind:
        case "box":
            shape = {"shapeType": p.GEOM_BOX, "halfExtents": [s / 2 for s in prop.size]}
        case "ball":
            shape = {"shapeType": p.GEOM_SPHERE, "radius": prop.size[0]}
        case "rod":
            along_x = p.getQuaternionFromEuler([0.0, np.pi / 2, 0.0])
            shape = {"shapeType": p.GEOM_CYLINDER, "length": prop.size[0], "radius": prop.size[1]}
            shape["visualFrameOrientation"] = along_x
    visual = p.createVisualShape(**shape, rgbaColor=[*prop.color, 1], physicsClientId=client)
    return int(p.createMultiBody(0, -1, visual, OUT_OF_SIGHT.translation.tolist(), physicsClientId=client))


def _socket_block(client: int, socket: Socket, friction: float) -> int:
    box = Box(name=socket.name, center=socket.center, size=socket.size, color=socket.color)
    return _box(client, box, friction, socket.world_from_block)
