"""Bodies: a link of one, and those that do not move by themselves: boxes, and props without a collision shape."""

from dataclasses import dataclass

import numpy as np
import pybullet as p
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cell import Box
from regrasp.interfaces.scene import Prop

# Where bodies are that nobody shall see: below the floor, and near, since the shadow map must span all bodies.
OUT_OF_SIGHT = RigidTransform.from_translation([0.2, 0.0, -0.4])


@dataclass(frozen=True)
class BodyLink:
    """A link of a body in a PyBullet client; -1 is the base."""

    client: int
    body: int
    link: int = -1


def build_box(client: int, box: Box, turn: Rotation | None = None, friction: float = 0.5) -> int:
    """Create a fixed box, turned about its centre if `turn` is given; returns the body's id.

    `friction` is its coefficient.
    """
    collision, visual = box_shapes(client, box)
    turn = Rotation.identity() if turn is None else turn
    body = p.createMultiBody(0, collision, visual, box.center, turn.as_quat().tolist(), physicsClientId=client)
    p.changeDynamics(body, -1, lateralFriction=friction, physicsClientId=client)
    return int(body)


def box_shapes(client: int, box: Box) -> tuple[int, int]:
    """The ids of a box's collision shape and of its visual shape."""
    half = [s / 2 for s in box.size]
    collision = p.createCollisionShape(p.GEOM_BOX, halfExtents=half, physicsClientId=client)
    visual = p.createVisualShape(p.GEOM_BOX, halfExtents=half, rgbaColor=[*box.color, 1], physicsClientId=client)
    return int(collision), int(visual)


def build_prop(client: int, prop: Prop) -> int:
    """Create a visual body, out of sight; returns its id."""
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
