"""The primitive actions at a printer: gripper, rail and arm, and the door in hand."""

from typing import Any, ClassVar

from regrasp.behaviors.leaf import LeafPort, LeafSteps, StepsLeaf
from regrasp.behaviors.printer.services import PrinterServices


class PrinterLeaf(StepsLeaf):
    """A leaf of the arm that works at the printer."""

    services: PrinterServices

    @property
    def hand(self) -> str:
        """The arm's name."""
        return self.services.known.printer.hand


class OpenGripper(PrinterLeaf):
    """Opens the gripper until its pads stand `opening` m apart."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "opening": LeafPort(data_type=float, above=0.0, description="m between the pads")
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        yield self.services.motion.release(self.hand, self.get_input("opening"))


class GripHandle(PrinterLeaf):
    """Closes the gripper on the handle of the door, and gives way to it; fails if it closes on nothing."""

    def steps(self) -> LeafSteps:
        """See the class."""
        yield self.services.motion.take_handle(self.hand)


class RailToHandle(PrinterLeaf):
    """Brings the rail to where the arm's base stands `beside` m along y from the handle."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "beside": LeafPort(data_type=float, description="m along y from the handle to the arm's base")
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        motion, base = self.services.motion, self.services.known.arm(self.hand).base
        handle = motion.handle(motion.door_opening).translation
        yield motion.move_rail(self.hand, float(handle[1] + self.get_input("beside") - base[1]))


class ReachHandle(PrinterLeaf):
    """Brings the open gripper `standoff` m before the handle, then straight round it."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "standoff": LeafPort(data_type=float, above=0.0, description="m before the handle, from where it goes straight")
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        motion = self.services.motion
        yield motion.reach(self.hand, motion.handle(motion.door_opening), self.get_input("standoff"))


class SlideDoor(PrinterLeaf):
    """Moves the rail, and with it the door whose handle the gripper holds, until the door stands `opening` m open."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "opening": LeafPort(data_type=float, description="m that the door shall stand open; 0 closes it")
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        motion = self.services.motion
        way = self.get_input("opening") - motion.door_opening
        yield motion.slide_door(self.hand, float(motion.joints(self.hand)[0] + way))


class ArmBack(PrinterLeaf):
    """Draws the gripper back straight, by `distance` m."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "distance": LeafPort(data_type=float, above=0.0, description="m away from the printer")
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        yield self.services.motion.shift(self.hand, [self.get_input("distance"), 0.0, 0.0], checked=False)
