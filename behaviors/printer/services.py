"""The services of the printer's leaves."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from regrasp.behaviors.services import Services
from regrasp.interfaces.printer.services import PrinterMotionService, PrinterPerceptionService

if TYPE_CHECKING:
    from regrasp.interfaces.printer.actions import GripperDevice, ImageAnalyzer, Manipulator, Rail, Turn
    from regrasp.interfaces.printer.cell import PrinterKnown


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
    arm_and_rail: "Turn"
    jaw: "Turn"
