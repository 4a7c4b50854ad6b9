"""What the arm does with the printed part in its hand: out of the printer, to the clamp, off its plate, to the tray."""

import math
from typing import Any, ClassVar

from py_trees.common import Status

from regrasp.behaviors.leaf import LeafFailed, LeafPort, LeafSteps
from regrasp.behaviors.printer.leaf import PrinterLeaf
from regrasp.interfaces.printer.actions import ClampGoal, RailGoal
from regrasp.interfaces.printer.cause import PrinterCause

_CLAMP = ("clamp_bed", "clamp_left", "clamp_right")
_TRAY = ("tray", "tray_back", "tray_front", "tray_left", "tray_right", "desk")


class DrawOutPart(PrinterLeaf):
    """Draws the part that the gripper holds out of the printer, with its plate, straight by `distance` m."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "distance": LeafPort(data_type=float, above=0.0, description="m back along the hand")
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        yield self.with_arm(self.services.motion.draw_out(self.hand, self.get_input("distance")))


class _Over(PrinterLeaf):
    """Carries what the gripper holds over a place, with the arm's base beside it."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "above": LeafPort(data_type=float, above=0.0, description="m over the place"),
        "beside": LeafPort(data_type=float, description="m along y from the place to the arm's base"),
    }

    def over(
        self, thing: str, place: tuple[float, float, float], may_touch: tuple[str, ...], back: float = 0.0
    ) -> LeafSteps:
        """Bring the middle of the thing in the hand `above` a place (3,) m.

        From there it can go straight down, and the hand then `back` m straight back.
        """
        import numpy as np  # late: a tree's check needs no numpy
        from scipy.spatial.transform import RigidTransform

        motion, above = self.services.motion, self.get_input("above")
        base = self.services.known.arm(self.hand).base
        yield self.services.rail.send(RailGoal(place[1] + self.get_input("beside") - base[1]))
        goal = motion.held_goal(self.hand, thing, np.add(place, [0.0, 0.0, above]))
        down = RigidTransform.from_translation([0.0, 0.0, -above])
        away = down * RigidTransform.from_translation([-back, 0.0, 0.0])
        yield self.with_arm(motion.carry(self.hand, goal, [down, away], may_touch))


class PlateOverClamp(_Over):
    """Carries part and plate over the clamp, with the arm's base `beside` it, to where they can go straight down."""

    def steps(self) -> LeafSteps:
        """See the class."""
        yield from self.over("plate", self.services.known.printer.clamp.center, _CLAMP)


class PartOverTray(_Over):
    """Carries the part over the tray, with the arm's base `beside` it.

    From there it can go straight down, and the hand then `back` m straight back.
    """

    INPUT_PORTS: ClassVar[dict[str, Any]] = _Over.INPUT_PORTS | {
        "back": LeafPort(data_type=float, above=0.0, description="m that the hand will draw back")
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        printer = self.services.known.printer
        tray = next(box for box in self.services.known.boxes if box.name == "tray")
        top = tray.center[2] + 0.5 * tray.size[2]
        yield from self.over(
            "part", (tray.center[0], tray.center[1], top + 0.5 * printer.part.size[2]), _TRAY, self.get_input("back")
        )


class MoveHeld(PrinterLeaf):
    """Brings what the gripper holds straight on by `dx`, `dy`, `dz` m; it may touch the clamp and the tray."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        name: LeafPort(data_type=float, required=False, default_value=0.0, description=words)
        for name, words in (
            *((f"d{axis}", f"m along {axis}") for axis in "xyz"),
            ("dz_floating", "m more along z where there is no gravity"),
        )
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        import numpy as np  # late: a tree's check needs no numpy

        way = np.array([self.get_input(name) for name in ("dx", "dy", "dz")])
        if self.services.motion.floats(self.hand):
            way[2] += self.get_input("dz_floating")
        yield self.with_arm(self.services.motion.move_held(self.hand, way, _CLAMP + _TRAY))


class ClampPlate(PrinterLeaf):
    """Closes the clamp on the plate, which no hand holds any more; fails if the clamp closes on nothing."""

    slack = 0.005  # m that a jaw goes further in than a plate lets it, from which it holds none; choice

    def steps(self) -> LeafSteps:
        """See the class."""
        clamp = self.services.known.printer.clamp
        action = self.services.clamp.send(ClampGoal(closed=True))
        yield action
        if min(action.answer.travel) > clamp.stroke + self.slack:
            raise LeafFailed(PrinterCause.CLAMP_EMPTY, f"the clamp closed on nothing: {action.answer}")


class GripPart(PrinterLeaf):
    """Closes the gripper on the section between its pads; fails if it closes on nothing."""

    def steps(self) -> LeafSteps:
        """See the class."""
        yield self.with_hand(self.services.motion.grip_part(self.hand))


class OpenClamp(PrinterLeaf):
    """Opens the clamp."""

    def steps(self) -> LeafSteps:
        """See the class."""
        yield self.services.clamp.send(ClampGoal(closed=False))


class TwistPart(PrinterLeaf):
    """Turns the part about its upright axis until it comes off the clamped plate, and back; fails if it does not."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "angle_deg": LeafPort(data_type=float, description="degrees about the upright axis")
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        yield self.with_hand(self.services.motion.twist(self.hand, math.radians(self.get_input("angle_deg"))))


class ForgetHeld(PrinterLeaf):
    """Takes what the gripper has lost to be where it lost it."""

    RETURNS = frozenset({Status.SUCCESS})

    def steps(self) -> LeafSteps:
        """See the class."""
        self.services.motion.believe_lost(self.hand)
        yield from ()


class ReleasePart(PrinterLeaf):
    """Opens the gripper to `gap` m, softly: the part stays where it is."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "gap": LeafPort(data_type=float, above=0.0, description="m between the pads")
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        yield self.with_hand(self.services.motion.release_part(self.hand, self.get_input("gap")))
