"""The arm, its rail and its gripper as devices that do one goal at a time, see `regrasp.interfaces.printer.actions`."""

from collections.abc import Callable, Generator
from typing import Any, TypeVar

from regrasp.interfaces.printer.actions import (
    Action,
    GripperGoal,
    GripperState,
    JointGoal,
    ManipulatorGoal,
    ManipulatorState,
    PoseGoal,
    PoseRelGoal,
    RailGoal,
    RailState,
)
from regrasp.interfaces.request import Request
from regrasp.motion.printer.service import PrinterMotion

State = TypeVar("State")


class OneAtATime:
    """What arm and rail share: a goal of either preempts one under way of both."""

    def __init__(self) -> None:
        self._under_way: Action[Any, Any] | None = None

    def begin(self, action: Action[State, State]) -> Action[State, State]:
        """Cancel the action under way; the new one, to be polled."""
        if self._under_way is not None:
            self._under_way.cancel()
        self._under_way = action
        return action


class _Device:
    """A device of one arm. What moves the arm begins once it rests: it may still brake after what was preempted."""

    moves_the_arm = True

    def __init__(self, motion: PrinterMotion, arm: str, turn: OneAtATime) -> None:
        self._motion, self._arm, self._turn = motion, arm, turn

    def _action(self, request: Request[Any], state: Callable[[], State]) -> Action[State, State]:
        """The request as an action whose feedback and result are the device's state."""

        def steps() -> Generator[None, None, State]:
            while self.moves_the_arm and self._motion.arms[self._arm].is_moving():
                yield
            while not request.poll():
                yield
            return state()

        return self._turn.begin(Action(steps(), state, request.cancel))


class ArmManipulator(_Device):
    """Implements `regrasp.interfaces.printer.actions.Manipulator`."""

    def send(self, goal: ManipulatorGoal) -> Action[ManipulatorState, ManipulatorState]:
        """See `Device`. It may end with each of the causes of `PlanningError` that concern an arm's motion.

        Raises ValueError for another number of angles than the arm has joints, and for things that are not there.
        """
        motion, arm = self._motion, self._arm
        match goal:
            case PoseGoal():
                request = motion.reach(arm, goal.pose, goal.standoff, goal.may_touch, goal.onward)
            case PoseRelGoal():
                request = motion.shift(arm, goal.offset, without=motion.things(goal.may_touch))
            case JointGoal():
                request = motion.move_joints(arm, goal.angles)
            case _:
                raise _foreign("manipulator", "PoseGoal, PoseRelGoal and JointGoal", goal)
        return self._action(request, self.state)

    def state(self) -> ManipulatorState:
        """Where the arm is, as read."""
        return ManipulatorState(self._motion.joints(self._arm), self._motion.tool(self._arm))


class ArmRail(_Device):
    """Implements `regrasp.interfaces.printer.actions.Rail`."""

    def send(self, goal: RailGoal) -> Action[RailState, RailState]:
        """See `Device`. It ends with OUT_OF_REACH, MOTION_BLOCKED or ARM_FAILED."""
        if not isinstance(goal, RailGoal):
            raise _foreign("rail", "RailGoal", goal)
        return self._action(self._motion.move_rail(self._arm, goal.position), self.state)

    def state(self) -> RailState:
        """Where the rail is, as read."""
        return RailState(float(self._motion.joints(self._arm)[0]))


class ArmGripper(_Device):
    """Implements `regrasp.interfaces.printer.actions.GripperDevice`."""

    moves_the_arm = False

    def send(self, goal: GripperGoal) -> Action[GripperState, GripperState]:
        """See `Device`. It ends with OUT_OF_REACH for a gap that the jaw has not, and with GRIPPER_FAILED."""
        if not isinstance(goal, GripperGoal):
            raise _foreign("gripper", "GripperGoal", goal)
        return self._action(self._motion.move_jaw(self._arm, goal.gap, goal.force), self.state)

    def state(self) -> GripperState:
        """The gap between the pads, as read."""
        return GripperState(self._motion.grippers[self._arm].reading().gap)


def _foreign(device: str, takes: str, goal: object) -> TypeError:
    return TypeError(f"the {device} takes {takes}, not {type(goal).__name__}")
