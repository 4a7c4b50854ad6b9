"""The printer's sliding door with its handle."""

import pybullet as p

from regrasp.interfaces.cell import Box
from regrasp.interfaces.printer.cell import Door, HiddenPrinter

_DOOR, _HANDLE = 0, 1  # links


class SimDoor:
    """A door on a slide with dry friction: it moves where more than that pulls along y, and stops by itself.

    Its base is a fixed point where the closed door's middle is. The door is the base's first link, and the handle is
    a link on the door. A stiff motor holds it where it is mounted, so that a fault can shift it along y.
    """

    panel_link = _DOOR

    def __init__(self, client: int, door: Door, hidden: HiddenPrinter) -> None:
        self._client = client
        panel, handle = door.parts(0.0)
        x, y, z = handle.center
        handle = handle.model_copy(update={"center": (x, y + hidden.handle_off[0], z + hidden.handle_off[1])})
        # What holds the handle is as thick as the handle and reaches from it to the door's front.
        gap = handle.center[0] - panel.center[0] - 0.5 * (panel.size[0] + handle.size[0])
        away = [b - a for a, b in zip(panel.center, handle.center, strict=True)]
        shapes = [self._shape([panel], [[0.0, 0.0, 0.0]])]
        feet = [
            Box(name="foot", center=(0.0, 0.0, 0.0), size=(gap, handle.size[1], 0.02), color=handle.color)
            for _ in range(2)
        ]
        ends = [0.5 * handle.size[2] - 0.01, -0.5 * handle.size[2] + 0.01]
        places = [[-0.5 * (handle.size[0] + gap), 0.0, z] for z in ends]
        shapes.append(self._shape([handle, *feet], [[0.0, 0.0, 0.0], *places]))
        level = [0.0, 0.0, 0.0, 1.0]
        self.body = int(
            p.createMultiBody(
                baseMass=0,
                basePosition=list(panel.center),
                linkMasses=[0.9 * hidden.door_mass, 0.1 * hidden.door_mass],
                linkCollisionShapeIndices=[shape[0] for shape in shapes],
                linkVisualShapeIndices=[shape[1] for shape in shapes],
                linkPositions=[[0.0, 0.0, 0.0], away],
                linkOrientations=[level, level],
                linkInertialFramePositions=[[0.0, 0.0, 0.0]] * 2,
                linkInertialFrameOrientations=[level, level],
                linkParentIndices=[0, 1],
                linkJointTypes=[p.JOINT_PRISMATIC, p.JOINT_PRISMATIC],
                linkJointAxis=[[0, 1, 0], [0, 1, 0]],
                physicsClientId=client,
            )
        )
        p.changeDynamics(
            self.body,
            _DOOR,
            jointLowerLimit=0.0,
            jointUpperLimit=door.travel,
            linearDamping=0.0,
            jointDamping=0.0,
            physicsClientId=client,
        )
        p.resetJointState(self.body, _DOOR, door.opening, physicsClientId=client)
        p.changeDynamics(self.body, _HANDLE, lateralFriction=hidden.handle_friction, physicsClientId=client)
        self.rub(hidden.door_friction)
        self.shift_handle(0.0)

    @property
    def opening(self) -> float:
        """How far, m, the door stands open."""
        return float(p.getJointState(self.body, _DOOR, physicsClientId=self._client)[0])

    def rub(self, friction: float) -> None:
        """Let the slide resist with this force (N) from now on."""
        # A motor that wants to stand still with no more than this force is Coulomb's friction.
        p.setJointMotorControl2(
            self.body, _DOOR, p.VELOCITY_CONTROL, targetVelocity=0.0, force=friction, physicsClientId=self._client
        )

    def push(self, speed: float, force: float) -> None:
        """Push it along y with this speed (m/s) and at most this force (N) from now on, until `rub` is called."""
        p.setJointMotorControl2(
            self.body, _DOOR, p.VELOCITY_CONTROL, targetVelocity=speed, force=force, physicsClientId=self._client
        )

    def shift_handle(self, by: float) -> None:
        """Hold the handle `by` m along the door from where it was mounted, from now on."""
        p.setJointMotorControl2(
            self.body,
            _HANDLE,
            p.POSITION_CONTROL,
            targetPosition=by,
            positionGain=1.0,
            force=2000.0,
            physicsClientId=self._client,
        )

    def _shape(self, boxes: list[Box], places: list[list[float]]) -> tuple[int, int]:
        halves = [[0.5 * edge for edge in box.size] for box in boxes]
        kinds, colors = [p.GEOM_BOX] * len(boxes), [[*box.color, 1.0] for box in boxes]
        collision = p.createCollisionShapeArray(
            shapeTypes=kinds, halfExtents=halves, collisionFramePositions=places, physicsClientId=self._client
        )
        visual = p.createVisualShapeArray(
            shapeTypes=kinds,
            halfExtents=halves,
            rgbaColors=colors,
            visualFramePositions=places,
            physicsClientId=self._client,
        )
        return collision, visual
