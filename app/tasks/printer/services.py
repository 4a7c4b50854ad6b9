"""The services of a robot at a printer."""

from functools import partial
from typing import Any

from regrasp.app.run.compose import connected
from regrasp.behaviors.printer.services import PrinterServices
from regrasp.interfaces.devices import Clock
from regrasp.interfaces.printer.actions import Clamp
from regrasp.interfaces.printer.cell import PrinterKnown
from regrasp.motion.printer.devices import ArmGripper, ArmManipulator, ArmRail, DeskClamp, OneAtATime
from regrasp.motion.printer.transfer import TransferMotion
from regrasp.perception.printer.analyzer import PartAnalyzer
from regrasp.perception.printer.service import PrinterPerception
from regrasp.sim.printer.objects import PrinterObjects
from regrasp.sim.world import World


def printer_services(world: World[PrinterObjects], seed: int, log: Any) -> PrinterServices:
    """Motion with what concerns the printer, perception, and the four devices of the arm at work; see `connected`."""
    return connected(partial(_with_devices, world.objects.clamp), TransferMotion, PrinterPerception, world, seed, log)


def _with_devices(
    clamp: Clamp, known: PrinterKnown, clock: Clock, motion: TransferMotion, perception: PrinterPerception, log: Any
) -> PrinterServices:
    hand = known.printer.hand
    arm_and_rail, jaw = OneAtATime(motion.arms[hand].is_moving), OneAtATime()
    return PrinterServices(
        known,
        clock,
        motion,
        perception,
        log,
        manipulator=ArmManipulator(motion, hand, arm_and_rail),
        gripper=ArmGripper(motion, hand, jaw),
        rail=ArmRail(motion, hand, arm_and_rail),
        analyzer=PartAnalyzer(perception, known.printer, clock),
        clamp=DeskClamp(clamp, clock),
        arm_and_rail=arm_and_rail,
        jaw=jaw,
    )
