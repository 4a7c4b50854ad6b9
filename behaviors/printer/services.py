"""The services of the printer's leaves."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from regrasp.behaviors.services import Services
from regrasp.interfaces.printer.services import PrinterMotionService, PrinterPerceptionService

if TYPE_CHECKING:
    from regrasp.interfaces.printer.actions import ClampDevice, GripperDevice, ImageAnalyzer, Manipulator, Rail, Turn
    from regrasp.interfaces.printer.cell import PrinterKnown
    from regrasp.interfaces.task_network import State


@dataclass
class PrinterServices(Services):
    """The services of one run at a printer."""

    known: "PrinterKnown"
    motion: PrinterMotionService
    perception: PrinterPerceptionService
    manipulator: "Manipulator"
    gripper: "GripperDevice"
    rail: "Rail"
    analyzer: "ImageAnalyzer"
    clamp: "ClampDevice"
    arm_and_rail: "Turn"
    jaw: "Turn"

    def seen(self, state: "State") -> dict[str, str]:
        """See `Services`: where the door stands, and whether the hand still holds what it took."""
        door, section = self.known.printer.door, self.known.printer.part.section
        opening = self.motion.door_opening
        near_end = 0.05 * door.travel
        out = {"door": "closed" if opening < near_end else "open" if opening > door.travel - near_end else "ajar"}
        if state.get("door") == "unknown":
            out = {}
        if state.get("hand") == "full" and not self.motion.holds(self.known.printer.hand, section.size[1]):
            lost = {name: "lost" for name in ("plate", "part") if state.get(name) == "hand"}
            out |= {"hand": "empty", **lost}
        return out
