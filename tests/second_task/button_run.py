"""The second task's part of a run: what is in the world, the services, and the judge."""

from collections.abc import Iterator, Mapping
from typing import Any

import pybullet as p
from button import ButtonCell, ButtonGoesDark, ButtonMotion, ButtonPerception, ButtonServices, Expect
from scipy.spatial.transform import RigidTransform

from regrasp.app.run.compose import connected
from regrasp.app.task import judge
from regrasp.app.task.expectation import Expectation
from regrasp.interfaces.cell import Box
from regrasp.interfaces.scene import Prop
from regrasp.sim.bodies import OUT_OF_SIGHT, build_box, build_prop
from regrasp.sim.engine import Engine
from regrasp.sim.faults.effects import Effect, TaskEffects
from regrasp.sim.objects import TaskObjects
from regrasp.sim.world import World


class ButtonObjects(TaskObjects):
    """A box, a lamp on its front, and whether an arm has pressed it."""

    def __init__(self, cell: ButtonCell) -> None:
        self.cell = cell
        self.pressed_at: float | None = None

    def build_fixed(self, engine: Engine) -> Mapping[str, int]:
        spec, lit = self.cell.hidden.button, self.cell.known.button.color
        x, y, z = spec.place
        self._engine = engine
        self._body = build_box(engine.client, Box(name="button", center=spec.place, size=(0.04, spec.size, spec.size)))
        self._lamp = build_prop(engine.client, Prop("box", (0.002, 0.8 * spec.size, 0.8 * spec.size), lit))
        self._front = RigidTransform.from_translation([x - 0.021, y, z])
        self._put_lamp(self._front)
        return {"button": self._body}

    def effects(self) -> TaskEffects:
        def goes_dark(*_: Any) -> Effect:
            return Effect(lambda: self._put_lamp(OUT_OF_SIGHT), lambda: self._put_lamp(self._front))

        return {ButtonGoesDark: goes_dark}

    def after_step(self) -> None:
        force = sum(contact[9] for contact in p.getContactPoints(self._body, physicsClientId=self._engine.client))
        if self.pressed_at is None and force >= self.cell.hidden.button.force:
            self.pressed_at = self._engine.now()

    def _put_lamp(self, pose: RigidTransform) -> None:
        at, turn = pose.translation.tolist(), [0.0, 0.0, 0.0, 1.0]
        p.resetBasePositionAndOrientation(self._lamp, at, turn, physicsClientId=self._engine.client)


def services(world: World[ButtonObjects], seed: int, log: Any) -> ButtonServices:
    return connected(ButtonServices, ButtonMotion, ButtonPerception, world, seed, log)


class Judge(judge.Judge[Expect]):
    def states(self) -> Iterator[Expectation]:
        pressed = self.world.objects.pressed_at is not None
        if self.expect.pressed is not None:
            yield Expectation("pressed", pressed == self.expect.pressed, pressed, self.expect.pressed)

    def measured(self) -> dict[str, Any]:
        return {"pressed_at": self.world.objects.pressed_at}
