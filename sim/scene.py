"""The scene of a world: what stands still in it, and its props."""

from dataclasses import dataclass

import pybullet as p
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import KnownCell
from regrasp.interfaces.scene import Obstacle, SceneSetup
from regrasp.sim.bodies import OUT_OF_SIGHT, build_box, build_prop
from regrasp.sim.engine import Engine
from regrasp.sim.objects import TaskObjects


@dataclass(frozen=True)
class FoamParameters:
    """How the foam of the obstacles presses back: a spring and a damper at each point of contact.

    A soft polyurethane foam (50 to 100 kPa) 8 cm thick has 1.5 to 6 kN/m under 25 to 50 cm2 of a hand, which touches it
    at four points.
    """

    stiffness: float = 1000.0  # N/m
    damping: float = 5.0  # N s/m; choice: 3 N at 0.6 m/s


class Scene:
    """The cell's boxes, the fixed bodies of the task's objects, obstacles and props, built in this order.

    `fixed_bodies` holds the ids of all but the props by name: the boxes' names, those that the task gives, and
    `obstacle NAME`. `forbidden` names the bodies that no arm must touch: boxes and obstacles.

    Raises:
        ValueError: a body of the task has the name of a box.
    """

    def __init__(
        self,
        engine: Engine,
        known: KnownCell,
        objects: TaskObjects,
        setup: SceneSetup,
        foam: FoamParameters = FoamParameters(),
    ) -> None:
        self._client, self._foam = engine.client, foam
        boxes = {box.name: build_box(self._client, box) for box in known.boxes}
        of_task = objects.build_fixed(engine)
        if twice := boxes.keys() & of_task.keys():
            raise ValueError(f"a box of the cell and a body of the task are both named {', '.join(sorted(twice))}")
        obstacles = self._build_obstacles(setup.obstacles)
        self._props = [build_prop(self._client, prop) for prop in setup.props]
        self.fixed_bodies: dict[str, int] = {**boxes, **of_task, **obstacles}
        self.forbidden = {body: name for name, body in (boxes | obstacles).items()}

    def place_obstacle(self, name: str, center: FloatArray) -> None:
        """Move an obstacle that has no stand: the centre of its box to `center` (3,) m."""
        body = self.fixed_bodies[f"obstacle {name}"]
        turn = p.getBasePositionAndOrientation(body, physicsClientId=self._client)[1]
        p.resetBasePositionAndOrientation(body, center.tolist(), turn, physicsClientId=self._client)

    def place_prop(self, number: int, pose: RigidTransform | None) -> None:
        """Put prop `number` at `pose`, world_from_prop, or with None out of sight."""
        at = OUT_OF_SIGHT if pose is None else pose
        turn = at.rotation.as_quat().tolist()
        p.resetBasePositionAndOrientation(
            self._props[number], at.translation.tolist(), turn, physicsClientId=self._client
        )

    def _build_obstacles(self, obstacles: tuple[Obstacle, ...]) -> dict[str, int]:
        bodies = {}
        for obstacle in obstacles:
            turn = Rotation.from_euler("z", obstacle.yaw)
            for box in (obstacle.box, obstacle.stand):
                if box is not None:
                    body = bodies[f"obstacle {box.name}"] = build_box(self._client, box, turn)
                    p.changeDynamics(
                        body,
                        -1,
                        contactStiffness=self._foam.stiffness,
                        contactDamping=self._foam.damping,
                        physicsClientId=self._client,
                    )
        return bodies
