"""The services of a robot at a printer."""

from typing import Any

from regrasp.app.run.compose import connected
from regrasp.behaviors.printer.services import PrinterServices
from regrasp.motion.printer.service import PrinterMotion
from regrasp.perception.printer.service import PrinterPerception
from regrasp.sim.printer.objects import PrinterObjects
from regrasp.sim.world import World


def printer_services(world: World[PrinterObjects], seed: int, log: Any) -> PrinterServices:
    """Motion with what concerns the printer, and perception, see `connected`."""
    return connected(PrinterServices, PrinterMotion, PrinterPerception, world, seed, log)
