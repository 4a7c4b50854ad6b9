"""What the arm does with the printed part."""

from typing import Any, ClassVar, get_args

from regrasp.behaviors.leaf import LeafFailed, LeafPort, LeafSteps
from regrasp.behaviors.printer.approach import approach_steps
from regrasp.behaviors.printer.leaf import PrinterLeaf
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.printer.actions import PART_AND_BED, Action, Approach, PoseGoal, RailGoal


class RailToPart(PrinterLeaf):
    """Brings the rail to where the arm's base stands `beside` m along y from the part's gripping section."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "beside": LeafPort(data_type=float, description="m along y from the section to the arm's base")
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        place, base = self.services.motion.part_goal(0.0).translation, self.services.known.arm(self.hand).base
        yield self.services.rail.send(RailGoal(float(place[1] + self.get_input("beside") - base[1])))


class HandBeforePart(PrinterLeaf):
    """Brings the tool to an offset from its goal, `before` m before where the section is believed to be.

    From there the hand can go straight to the goal, and `deeper` m on.
    """

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        name: LeafPort(data_type=float, required=False, default_value=usual, description=f"m along {name[1]}")
        for name, usual in (("dx", 0.30), ("dy", 0.0), ("dz", 0.0))
    } | {
        "before": LeafPort(data_type=float, above=0.0, description="m from the goal to the section's front"),
        "deeper": LeafPort(data_type=float, above=0.0, description="m from the goal to the grasp"),
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        from scipy.spatial.transform import RigidTransform  # late: a tree's check needs no scipy

        goal = self.services.motion.part_goal(self.get_input("before"))
        start = RigidTransform.from_translation([self.get_input(name) for name in ("dx", "dy", "dz")]) * goal
        onward = start.inv() * goal, RigidTransform.from_translation([self.get_input("deeper"), 0.0, 0.0])
        yield self.services.manipulator.send(PoseGoal(start, may_touch=PART_AND_BED, onward=onward))


class ApproachPart(PrinterLeaf):
    """Goes from where the part is in sight to `before` m before its gripping section, by what the camera shows.

    The method is `servo`, which looks all the way, or one of the source's: `one_step` looks once and goes there,
    `two_step` centres the part first, and `three_step` also stops at a `buffer`. These three take the part and the
    camera to be aligned with the world.
    """

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "method": LeafPort(data_type=str, names="approach", description="servo, one_step, two_step or three_step"),
        "before": LeafPort(data_type=float, above=0.0, description="m from the goal to the section's front"),
        "buffer": LeafPort(
            data_type=float,
            required=False,
            default_value=0.25,
            above=0.0,
            description="m before the goal at which three_step stops",
        ),
        "seconds": LeafPort(
            data_type=float, required=False, default_value=1.0, above=0.0, description="simulated seconds for each look"
        ),
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        method = self.get_input("method")
        if method not in get_args(Approach):  # of a key, whose value no check of the tree knows
            why = f"no approach {method!r}; there are {', '.join(get_args(Approach))}"
            raise LeafFailed(CauseCode.PLANNING_FAILED, why)
        before, buffer, seconds = (self.get_input(name) for name in ("before", "buffer", "seconds"))
        yield from approach_steps(self.services, method, before, buffer, seconds, self.say)


class _Taking(PrinterLeaf):
    """Closes the gripper on the part's section, whether it stands or floats."""

    def catch(self, inside: float, moved: tuple[str, ...]) -> Action[str, Any]:
        """Go along with what floats, as the camera shows it, and close on the section `inside` m behind its front."""
        motion, gripper, now = self.services.motion, self.services.gripper, self.services.clock.now()
        tracker = self.services.perception.part_tracker(motion.tool_at, lambda: gripper.state().gap, now, self.say)
        return self.with_hand(motion.catch_part(self.hand, tracker, inside, moved))


class TakePart(_Taking):
    """Goes `deeper` m straight on and closes the gripper on the section; fails if it closes on nothing.

    A part that the approach saw move faster than 8 mm/s is caught on its way, `inside` m behind the section's front.
    """

    moves = 0.008  # m/s; choice: one that stands is seen to move by up to 3 mm/s, and 1 s of more would miss the jaw

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "deeper": LeafPort(data_type=float, above=0.0, description="m from the goal to the grasp"),
        "inside": LeafPort(
            data_type=float,
            required=False,
            default_value=0.007,
            above=0.0,
            description="m behind the section's front where the pads close on a part that moves",
        ),
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        if self.services.motion.part_speed > self.moves:
            yield self.catch(self.get_input("inside"), ("part", "section"))
        else:
            yield self.with_hand(self.services.motion.take_part(self.hand, self.get_input("deeper")))


class CatchPart(_Taking):
    """Goes to a part that is free by what the camera shows, goes along with it, and closes the gripper on its section.

    The pads then stand `inside` m behind the section's front. What is caught counts as a part of the arm.
    """

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "inside": LeafPort(data_type=float, above=0.0, description="m behind the section's front where the pads close"),
        "free": LeafPort(data_type=str, names="free", description="part: it is alone; both: it is on its plate"),
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        free = ("part", "section") if self.get_input("free") == "part" else ("plate", "part", "section")
        yield self.catch(self.get_input("inside"), free)
        self.services.motion.believe_held(self.hand, free)
