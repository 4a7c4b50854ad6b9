"""The objects of a task in the world: what the world asks of them, and when."""

from collections.abc import Mapping
from typing import TypeVar

from regrasp.interfaces.cell import Cell
from regrasp.sim.engine import Engine
from regrasp.sim.faults.effects import TaskEffects
from regrasp.sim.faults.faults import TriggerState
from regrasp.sim.robot.arm import SimArm


class TaskObjects:
    """A task's objects in one world. A task derives its own, and overrides what it has.

    While a world is built, it calls once, in this order:

    1. `build_fixed`, after the cell's boxes and before the obstacles,
    2. `build_moving`, after the arms,
    3. `lay_out`, before the cameras,
    4. `forbidden` and `grips`,
    5. `effects`.

    Every physics step has the order: the arms' servos, the effects of faults, `before_step`, the step, `after_step`;
    then, at the contact interval, the contacts' forces and `update_triggers`, and at last the cameras' exposures.

    Objects belong to one world: they may keep what these calls give them.
    """

    def build_fixed(self, engine: Engine) -> Mapping[str, int]:
        """Create the bodies that stand still; their ids by name, which no box of the cell has."""
        return {}

    def build_moving(self, engine: Engine, arms: Mapping[str, SimArm]) -> None:
        """Create the bodies that move."""

    def lay_out(self, engine: Engine, fixed: Mapping[str, int]) -> None:
        """Filter the moving bodies' collisions, and bring them to where the run begins.

        `fixed` holds the ids of all fixed bodies by name: the cell's boxes, the task's, and `obstacle NAME`. For the
        way to the beginning it may step the engine, whose clock starts afterwards; the arms hold still.
        """

    def forbidden(self) -> Mapping[int, str] | Mapping[tuple[int, int], str]:
        """The task's bodies that no arm must touch: names by ids, or by the ids of a body and its link."""
        return {}

    def grips(self) -> Mapping[tuple[int, int], tuple[int, int]]:
        """Links (a body's id and a link's) that the pads of a hand may touch as long as both touch another link."""
        return {}

    def effects(self) -> TaskEffects:
        """How the task's own faults act on the world."""
        return {}

    def before_step(self) -> None:
        """Act on the next physics step."""

    def after_step(self) -> None:
        """Look at what the last physics step did."""

    def update_triggers(self, now: float, triggers: TriggerState) -> None:
        """Write at second `now` what the task's faults may wait for: the `shares` and `phases` of `triggers`.

        It is called at second 0 and at the contact interval, while a fault waits.
        """


class NoObjects(TaskObjects):
    """For a task that adds nothing to its cell. Like other tasks' objects it is made from the cell, if one is given."""

    def __init__(self, cell: Cell | None = None) -> None:
        pass


# Covariant: a world of some task's objects will do where a world of any objects is wanted.
ObjectsT = TypeVar("ObjectsT", bound=TaskObjects, covariant=True)
