"""What a world is made of: physics settings, bodies that stand fast, which pairs may touch, the cable in its socket."""

from collections.abc import Mapping

import numpy as np
import pybullet as p
from scipy.spatial.transform import RigidTransform, Rotation, Slerp

from regrasp.interfaces.cell import Box, KnownCell, Socket
from regrasp.interfaces.hidden_world import HiddenWorld
from regrasp.interfaces.scene import EARTH_GRAVITY, Gravity, Obstacle, Prop
from regrasp.sim.cable.cable import CableBody
from regrasp.sim.cable.fixtures import Hold
from regrasp.sim.render.printed import tag_boxes, visual

LAY_SECONDS, SETTLE_SECONDS = 1.5, 2.5  # the cable is drawn from straight into its socket, then comes to rest
BOX_FRICTION = 0.5
OUT_OF_SIGHT = RigidTransform.from_translation([0.2, 0.0, -0.4])  # below the floor, near: shadows are drawn as finely
CLAMPED_LINKS = 4  # so many links at the cable's fixed end may pass through the socket and panel that they start in


def configure(client: int, hidden: HiddenWorld, gravity: Gravity) -> None:
    """Empty the client and set its gravity, step and solver."""
    p.resetSimulation(physicsClientId=client)
    p.setGravity(0, 0, -EARTH_GRAVITY if gravity == "earth" else 0.0, physicsClientId=client)
    p.setTimeStep(1.0 / hidden.step_rate, physicsClientId=client)
    p.setPhysicsEngineParameter(
        numSolverIterations=hidden.solver_iterations, deterministicOverlappingPairs=1, physicsClientId=client
    )


def build_boxes(client: int, known: KnownCell, obstacles: tuple[Obstacle, ...]) -> dict[str, int]:
    """Body ids of all that stands fast: floor, panels, clip bracket, sockets, and `obstacle NAME` for the obstacles."""
    bodies = {box.name: _box(client, box) for box in (*known.boxes, *known.clip.bracket)}
    bodies |= {socket.name: _socket_block(client, socket) for socket in known.sockets}
    if known.clip.tag is not None:
        world_from_tag = known.clip.world_from_seat * known.clip.tag.body_from_tag
        p.createMultiBody(0, -1, visual(client, tag_boxes(known.clip.tag), world_from_tag), physicsClientId=client)
    for obstacle in obstacles:
        turn = Rotation.from_euler("z", obstacle.yaw)
        for box in (obstacle.box, obstacle.stand):
            if box is not None:
                bodies[f"obstacle {box.name}"] = _box(client, box, turn)
    return bodies


def build_props(client: int, props: tuple[Prop, ...]) -> list[int]:
    """Body ids of things that are only seen, out of sight."""
    return [_prop(client, prop) for prop in props]


def filter_collisions(
    client: int, known: KnownCell, boxes: Mapping[str, int], arms: Mapping[int, str], cable: CableBody
) -> dict[int, str]:
    """Switch off the pairs that are joined by design: bases and floor, the plug and what takes it in, the clamp.

    `arms` names the arms' bodies. Returns the names of the bodies that an arm must not touch: all but the cable, the
    sockets and the clip.
    """
    takers = [s.name for s in known.sockets] + [b.name for b in known.clip.bracket]
    pairs = [(arm, -1, boxes["floor"]) for arm in arms if "floor" in boxes]
    pairs += [(cable.body, cable.connector_link, boxes[name]) for name in takers]
    clamp = [boxes[name] for name in (known.sockets[-1].name, "right_panel") if name in boxes]
    pairs += [(cable.body, link, box) for link in range(CLAMPED_LINKS) for box in clamp]
    for body, link, box in pairs:
        p.setCollisionFilterPair(body, box, link, -1, 0, physicsClientId=client)
    return {body: name for name, body in boxes.items() if name not in takers} | dict(arms)


def lay_cable(client: int, cable: CableBody, goal: RigidTransform, step: float) -> Hold:
    """Draw the end of the straight cable to the pose `goal`, let all come to rest, and leave the end held there.

    `step` is the physics step in s.
    """
    start, _, _ = cable.connector_state()
    hold = Hold(client, cable.body, cable.connector_link, start)
    turn = Slerp([0, 1], Rotation.concatenate([start.rotation, goal.rotation]))
    steps = round(LAY_SECONDS / step)
    for i in range(steps + round(SETTLE_SECONDS / step)):
        s = min(1.0, (i + 1) / steps)
        s = s * s * (3 - 2 * s)
        hold.move(RigidTransform.from_components((1 - s) * start.translation + s * goal.translation, turn(s)))
        cable.apply_springs()
        p.stepSimulation(physicsClientId=client)
    return hold


def _box(client: int, box: Box, turn: Rotation | None = None) -> int:
    half = [s / 2 for s in box.size]
    collision = p.createCollisionShape(p.GEOM_BOX, halfExtents=half, physicsClientId=client)
    visual = p.createVisualShape(p.GEOM_BOX, halfExtents=half, rgbaColor=[*box.color, 1], physicsClientId=client)
    turn = Rotation.identity() if turn is None else turn
    body = p.createMultiBody(0, collision, visual, box.center, turn.as_quat().tolist(), physicsClientId=client)
    p.changeDynamics(body, -1, lateralFriction=BOX_FRICTION, physicsClientId=client)
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


def _socket_block(client: int, socket: Socket) -> int:
    box = Box(name=socket.name, center=socket.center, size=socket.size, color=socket.color)
    return _box(client, box, socket.world_from_block)
