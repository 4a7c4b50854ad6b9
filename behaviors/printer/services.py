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
    door_slack: float = 0.02  # m from its ends within which the door counts as closed or open; choice

    def seen(self, state: "State") -> dict[str, str]:
        """See `Services`: where the door stands, and whether the hand still holds what it took."""
        door, section = self.known.printer.door, self.known.printer.part.section
        opening, out = self.motion.door_opening, {}
        if state.get("door") != "unknown":
            is_open = opening > door.travel - self.door_slack
            out["door"] = "closed" if opening < self.door_slack else "open" if is_open else "ajar"
        if state.get("hand") == "full" and not self.motion.holds(self.known.printer.hand, section.size[1]):
            lost = {name: "lost" for name in ("plate", "part") if state.get(name) == "hand"}
            out |= {"hand": "empty", **lost}
        return out
