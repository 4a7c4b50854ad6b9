"""The printer's objects in the world: its door."""

from collections.abc import Mapping

from regrasp.interfaces.printer.cell import PrinterCell
from regrasp.interfaces.printer.fault import DoorJams
from regrasp.sim.engine import Engine
from regrasp.sim.faults.effects import Effect, TaskEffects
from regrasp.sim.faults.faults import TriggerState
from regrasp.sim.objects import TaskObjects
from regrasp.sim.printer.door import SimDoor
from regrasp.sim.robot.arm import SimArm


class PrinterObjects(TaskObjects):
    """The door. An arm may touch its handle, and nothing else of it."""

    def __init__(self, cell: PrinterCell) -> None:
        self.cell = cell

    def build_moving(self, engine: Engine, arms: Mapping[str, SimArm]) -> None:
        """See `TaskObjects`."""
        self.door = SimDoor(engine.client, self.cell.known.printer.door, self.cell.hidden.printer)

    def effects(self) -> TaskEffects:
        """See `TaskObjects`."""

        def jams(fault: DoorJams, *_: object) -> Effect:
            usual = self.cell.hidden.printer.door_friction
            return Effect(lambda: self.door.rub(fault.friction), lambda: self.door.rub(usual))

        return {DoorJams: jams}

    def update_triggers(self, now: float, triggers: TriggerState) -> None:
        """See `TaskObjects`: the share of its travel that the door has been opened."""
        triggers.shares["opened"] = self.door.opening / self.cell.known.printer.door.travel

    def forbidden(self) -> Mapping[tuple[int, int], str]:
        """See `TaskObjects`: the door without its handle."""
        return {(self.door.body, self.door.panel_link): "door"}
