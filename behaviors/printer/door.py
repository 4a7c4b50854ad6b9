"""What the arm does with the printer's door."""

from typing import Any, ClassVar

from regrasp.behaviors.leaf import LeafFailed, LeafPort, LeafSteps
from regrasp.behaviors.printer.leaf import PrinterLeaf
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.printer.actions import PoseGoal, RailGoal
from regrasp.interfaces.printer.cause import PrinterCause


class GripHandle(PrinterLeaf):
    """Closes the gripper on the handle of the door, and gives way to it; fails if it closes on nothing."""

    def steps(self) -> LeafSteps:
        """See the class."""
        yield self.with_hand(self.services.motion.take_handle(self.hand))


class RailToHandle(PrinterLeaf):
    """Brings the rail to where the arm's base stands `beside` m along y from the handle."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "beside": LeafPort(data_type=float, description="m along y from the handle to the arm's base")
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        motion, base = self.services.motion, self.services.known.arm(self.hand).base
        handle = motion.handle(motion.door_opening).translation
        yield self.services.rail.send(RailGoal(float(handle[1] + self.get_input("beside") - base[1])))


class LookAtHandle(PrinterLeaf):
    """Brings the camera before the handle, and takes the handle to be where it is seen.

    The tool stands `standoff` m before where the handle is believed to be; the leaf fails if no frame of the next
    `seconds` shows it.
    """

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "standoff": LeafPort(data_type=float, above=0.0, description="m before the handle, from where it is looked at"),
        "seconds": LeafPort(data_type=float, above=0.0, description="simulated seconds of looking"),
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        motion, known, perception = self.services.motion, self.services.known.printer, self.services.perception
        before = motion.handle(motion.door_opening, self.get_input("standoff"))
        yield self.services.manipulator.send(PoseGoal(before))
        begin = self.services.clock.now()
        while (place := perception.see_handle(known.camera, begin)) is None:
            if self.services.clock.now() > begin + self.get_input("seconds"):
                trouble = perception.trouble(known.camera)
                why = f"the {known.camera} camera did not show the handle in {self.get_input('seconds'):g} s"
                code = PrinterCause.HANDLE_NOT_FOUND if trouble is None else CauseCode.CAMERA_FAILED
                raise LeafFailed(code, why if trouble is None else f"{why}: {trouble}")
            yield None
        off = motion.believe_handle(place)
        self.say("saw the handle", position=place.round(4).tolist(), off=off.round(4).tolist())


class FindDoor(LookAtHandle):
    """Looks for the handle where the door is believed to stand, then where it stands closed, and wide open.

    The door is taken to stand where the handle is seen; the leaf fails if it is seen nowhere.
    """

    def steps(self) -> LeafSteps:
        """See the class."""
        motion, travel = self.services.motion, self.services.known.printer.door.travel
        for opening in (motion.door_opening, 0.0, travel):
            motion.believe_door(opening)
            try:
                yield from super().steps()
            except LeafFailed as error:
                failed = error
                if error.code != PrinterCause.HANDLE_NOT_FOUND:
                    raise
            else:
                return
        raise failed


class ReachHandle(PrinterLeaf):
    """Brings the open gripper `standoff` m before the handle, then straight round it.

    It fails if the gripper is not open wide enough for the handle.
    """

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "standoff": LeafPort(data_type=float, above=0.0, description="m before the handle, from where it goes straight")
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        motion = self.services.motion
        gap, thickness = self.services.gripper.state().gap, self.services.known.printer.door.handle.size[1]
        if gap <= thickness:
            why = f"the jaw stands {1e3 * gap:.1f} mm open, and the handle is {1e3 * thickness:.1f} mm thick"
            raise LeafFailed(CauseCode.MOTION_BLOCKED, why)
        handle = motion.handle(motion.door_opening)
        yield self.services.manipulator.send(PoseGoal(handle, self.get_input("standoff"), ("door_handle",)))


class SlideDoor(PrinterLeaf):
    """Moves the rail, and with it the door whose handle the gripper holds, until the door stands `opening` m open."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "opening": LeafPort(data_type=float, least=0.0, description="m that the door shall stand open; 0 closes it")
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        motion = self.services.motion
        way = self.get_input("opening") - motion.door_opening
        yield self.with_arm(motion.slide_door(self.hand, float(motion.joints(self.hand)[0] + way)))


class ArmBack(PrinterLeaf):
    """Draws the gripper back straight, by `distance` m."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "distance": LeafPort(data_type=float, above=0.0, description="m back along the hand")
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        yield self.with_arm(self.services.motion.draw_back(self.hand, self.get_input("distance")))
