"""The primitive actions: a leaf for each goal that the four devices take."""

from typing import Any, ClassVar

from regrasp.behaviors.leaf import LeafFailed, LeafPort, LeafSteps
from regrasp.behaviors.printer.leaf import PrinterLeaf
from regrasp.interfaces.printer.actions import GripperGoal, ImageGoal, JointGoal, PoseGoal, PoseRelGoal, RailGoal
from regrasp.interfaces.printer.cause import PrinterCause


def _meters(what: str) -> LeafPort:
    return LeafPort(data_type=float, description=f"m, {what}")


def _degrees(about: str, usual: float) -> LeafPort:
    return LeafPort(
        data_type=float, required=False, default_value=usual, description=f"degrees, the tool's turn about {about}"
    )


class MoveToPose(PrinterLeaf):
    """Brings the tool to a pose in the world along a free path; the rail moves too where the arm does not reach.

    The tool's x axis points out of the hand. It is turned by roll about x, then by pitch about y, then by yaw about z,
    all axes of the world; left out, it points to the printer. The last `standoff` m it goes straight.
    """

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "x": _meters("in the world"),
        "y": _meters("in the world"),
        "z": _meters("in the world"),
        "roll": _degrees("x", 0.0),
        "pitch": _degrees("y", 0.0),
        "yaw": _degrees("z", 180.0),
        "standoff": LeafPort(
            data_type=float,
            required=False,
            default_value=0.0,
            least=0.0,
            description="m before the pose, from where it goes straight",
        ),
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        position, turn = ([self.get_input(name) for name in names] for names in ("xyz", ("roll", "pitch", "yaw")))
        yield self.services.manipulator.send(PoseGoal.at(position, turn, self.get_input("standoff")))


class MoveBy(PrinterLeaf):
    """Moves the tool straight by an offset along the world's axes."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        name: LeafPort(data_type=float, required=False, default_value=0.0, description=f"m along {name[1]}")
        for name in ("dx", "dy", "dz")
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        dx, dy, dz = (self.get_input(name) for name in self.INPUT_PORTS)
        yield self.services.manipulator.send(PoseRelGoal((dx, dy, dz)))


class MoveJoints(PrinterLeaf):
    """Brings the six joints of the arm to angles along a free path; the rail stands."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        f"q{i}": LeafPort(data_type=float, description=f"rad, of joint {i}, counted from the base") for i in range(1, 7)
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        yield self.services.manipulator.send(JointGoal(tuple(self.get_input(name) for name in self.INPUT_PORTS)))


class MoveGripper(PrinterLeaf):
    """Brings the gripper's pads `gap` m from each other."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "gap": LeafPort(data_type=float, least=0.0, description="m between the pads")
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        yield self.services.gripper.send(GripperGoal(self.get_input("gap")))


class PressGripper(PrinterLeaf):
    """Closes the gripper on what is between its pads until they press with `force`.

    It fails if nothing is between them.
    """

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "force": LeafPort(data_type=float, above=0.0, description="N of each finger")
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        yield self.services.gripper.send(GripperGoal(force=self.get_input("force")))


class MoveRail(PrinterLeaf):
    """Brings the rail to a position; the arm's other joints stand."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {"position": _meters("along the rail")}

    def steps(self) -> LeafSteps:
        """See the class."""
        yield self.services.rail.send(RailGoal(self.get_input("position")))


class AnalyzeImage(PrinterLeaf):
    """Finds a target in the picture of the hand's camera: `obj`, the red part, or `targ`, its blue gripping section."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "target": LeafPort(
            data_type=str, required=False, default_value="obj", names="target", description="obj or targ"
        ),
        "seconds": LeafPort(
            data_type=float, required=False, default_value=1.0, above=0.0, description="simulated seconds of looking"
        ),
    }
    OUTPUT_PORTS: ClassVar[dict[str, Any]] = {
        "right": LeafPort(data_type=float, required=False, description="px right from the picture's centre to its own"),
        "down": LeafPort(data_type=float, required=False, description="px down from the picture's centre to its own"),
        "area": LeafPort(data_type=float, required=False, description="px2 of the target's box"),
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        try:
            goal = ImageGoal(self.get_input("target"), self.get_input("seconds"))
        except ValueError as error:  # of a key, whose value no check of the tree knows
            raise LeafFailed(PrinterCause.TARGET_NOT_SEEN, str(error)) from error
        seen = yield from self.ask(self.services.analyzer.send(goal))
        for name, value in zip(self.OUTPUT_PORTS, (*seen.offset, seen.area), strict=True):
            self._set_output(name, value)
        self.say("saw the target", target=goal.target, offset=seen.offset, area=seen.area)
