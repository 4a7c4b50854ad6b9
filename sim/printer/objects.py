"""The printer's objects in the world: its door, the part on its plate, and the clamp on the desk."""

from collections.abc import Mapping

import numpy as np

from regrasp.interfaces.printer.cell import PrinterCell
from regrasp.interfaces.printer.fault import (
    BondBreaks,
    DoorCloses,
    DoorJams,
    HandleMoves,
    PartFloats,
    PartKnocked,
    PartTaken,
    PlateSticks,
)
from regrasp.sim.engine import Engine
from regrasp.sim.faults.effects import Effect, TaskEffects
from regrasp.sim.faults.faults import TriggerState
from regrasp.sim.objects import TaskObjects
from regrasp.sim.printer.clamp import SimClamp
from regrasp.sim.printer.door import SimDoor
from regrasp.sim.printer.part import SimPart
from regrasp.sim.robot.arm import SimArm


class PrinterObjects(TaskObjects):
    """The door, the part on its plate, and the clamp.

    An arm may touch the door's handle and the part's gripping section, the pads that hold it the whole part, and
    nothing else of them.
    """

    def __init__(self, cell: PrinterCell) -> None:
        self.cell = cell

    def build_moving(self, engine: Engine, arms: Mapping[str, SimArm]) -> None:
        """See `TaskObjects`."""
        known, hidden = self.cell.known.printer, self.cell.hidden.printer
        self.part = SimPart(engine, known, hidden)
        self.clamp = SimClamp(engine.client, known, hidden, self.part.plate)
        self.door = SimDoor(engine.client, known.door, hidden)

    def door_closed(self, slack: float = 0.01) -> bool:
        """Whether the door is closed, to `slack` m."""
        return self.door.opening < slack

    def part_in_tray(self, slow: float = 0.01, height: float = 0.10) -> bool:
        """Whether the part's middle is in the tray, up to `height` m over its floor, and no faster than `slow` m/s."""
        tray = next(box for box in self.cell.known.boxes if box.name == "tray")
        place = self.part.pose(self.part.part).translation
        off = place - tray.center
        inside = bool(np.all(np.abs(off[:2]) < 0.5 * np.array(tray.size[:2]))) and 0.0 < off[2] < height
        return inside and self.part.speed() < slow

    def plate_in_clamp(self, off: float = 0.01) -> bool:
        """Whether the plate lies in the closed clamp, to `off` m of its middle."""
        place = self.part.pose(self.part.plate).translation
        near = float(np.linalg.norm(place - self.cell.known.printer.clamp.center)) < off
        return near and self.clamp.presses(self.part.plate)

    def effects(self) -> TaskEffects:
        """See `TaskObjects`."""

        def jams(fault: DoorJams, *_: object) -> Effect:
            usual = self.cell.hidden.printer.door_friction
            return Effect(lambda: self.door.rub(fault.friction), lambda: self.door.rub(usual))

        def moves(fault: HandleMoves, *_: object) -> Effect:
            seconds = 0.2  # slow enough that friction holds the door meanwhile
            return Effect(step=lambda t: self.door.shift_handle(min(1.0, t / seconds) * fault.by), seconds=seconds)

        def knocked(fault: PartKnocked, *_: object) -> Effect:
            seconds, way = 0.2, np.array([*fault.by, 0.0])  # slow enough that bond and catch hold
            return Effect(step=lambda t: self.part.slide(min(1.0, t / seconds) * way), seconds=seconds)

        def floats(fault: PartFloats, *_: object) -> Effect:
            velocity = np.array(fault.velocity)
            return Effect(lambda: self.part.float_off(velocity), lambda: self.part.float_off(np.zeros(3)))

        def taken(*_: object) -> Effect:
            return Effect(self.part.take_away)

        def breaks(*_: object) -> Effect:
            return Effect(lambda: self.part.float_off(None))

        def sticks(fault: PlateSticks, *_: object) -> Effect:
            return Effect(lambda: self.part.catch.stick(fault.force))

        def closes(fault: DoorCloses, *_: object) -> Effect:
            speed, usual = 0.3, self.cell.hidden.printer.door_friction
            seconds = self.cell.known.printer.door.travel / speed + 0.5
            return Effect(lambda: self.door.push(-speed, fault.force), lambda: self.door.rub(usual), seconds=seconds)

        return {
            BondBreaks: breaks,
            DoorCloses: closes,
            DoorJams: jams,
            HandleMoves: moves,
            PartFloats: floats,
            PartKnocked: knocked,
            PartTaken: taken,
            PlateSticks: sticks,
        }

    def after_step(self) -> None:
        """See `TaskObjects`: the catch or the bond may let go."""
        self.part.step()

    def update_triggers(self, now: float, triggers: TriggerState) -> None:
        """See `TaskObjects`: the share of its travel that the door has been opened."""
        triggers.shares["opened"] = self.door.opening / self.cell.known.printer.door.travel

    def forbidden(self) -> Mapping[tuple[int, int], str]:
        """See `TaskObjects`: the door without its handle, the part without its gripping section, plate and clamp."""
        return {
            (self.door.body, self.door.panel_link): "door",
            (self.part.part, -1): "part",
            (self.part.plate, -1): "plate",
            **{(self.clamp.body, jaw): "clamp" for jaw in self.clamp.jaws},
        }

    def grips(self) -> Mapping[tuple[int, int], tuple[int, int]]:
        """See `TaskObjects`: the whole part, by its section."""
        return {(self.part.part, -1): (self.part.part, self.part.section_link)}
