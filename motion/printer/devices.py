"""The arm, its rail and its gripper as devices that do one goal at a time, see `regrasp.interfaces.printer.actions`."""

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from typing import Any, TypeVar

from regrasp.interfaces.devices import Clock
from regrasp.interfaces.printer.actions import (
    Action,
    Clamp,
    ClampGoal,
    ClampState,
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
    """Who moves a part of the robot, such as arm and rail together, or the jaw: a new action preempts the last one.

    `moving` tells whether the part still moves: it may brake after what was preempted, and a new action begins once it
    rests.
    """

    def __init__(self, moving: Callable[[], bool] = lambda: False) -> None:
        self._moving = moving
        self._under_way: Action[Any, Any] | None = None

    def take(
        self, request: Request[Any], feedback: Callable[[], State], result: Callable[[], Any] | None = None
    ) -> Action[State, Any]:
        """The request as an action, to be polled; its answer is the request's, or the `result` when it is done."""

        def steps() -> Generator[None, None, Any]:
            while self._moving():
                yield
            while not request.poll():
                yield
            return request.answer if result is None else result()

        if self._under_way is not None:
            self._under_way.preempt()
        self._under_way = Action(steps(), feedback, request.cancel)
        return self._under_way


class _Device:
    """A device of one arm, which takes its turn with what else moves the same part."""

    def __init__(self, motion: PrinterMotion, arm: str, turn: OneAtATime) -> None:
        self._motion, self._arm, self._turn = motion, arm, turn

    def _action(self, request: Request[Any], state: Callable[[], State]) -> Action[State, State]:
        """The request as an action whose feedback and result are the device's state."""
        return self._turn.take(request, state, state)


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

    def send(self, goal: GripperGoal) -> Action[GripperState, GripperState]:
        """See `Device`. It ends with OUT_OF_REACH for a gap that the jaw has not, and with GRIPPER_FAILED."""
        if not isinstance(goal, GripperGoal):
            raise _foreign("gripper", "GripperGoal", goal)
        return self._action(self._motion.move_jaw(self._arm, goal.gap, goal.force), self.state)

    def state(self) -> GripperState:
        """The gap between the pads, as read."""
        return GripperState(self._motion.grippers[self._arm].reading().gap)


@dataclass(frozen=True)
class ClampParameters:
    """When the clamp's jaws have come to rest."""

    seconds: float = 2.0  # at most; they go 20 mm in one
    still: float = 0.15  # s for which they must rest; choice
    moves: float = 1e-4  # m in that time that count as rest; choice


class DeskClamp:
    """The clamp on the desk as a device: implements `regrasp.interfaces.printer.actions.ClampDevice`."""

    def __init__(self, clamp: Clamp, clock: Clock, parameters: ClampParameters = ClampParameters()) -> None:
        self._clamp, self._clock, self._parameters = clamp, clock, parameters
        self._turn = OneAtATime()

    def send(self, goal: ClampGoal) -> Action[ClampState, ClampState]:
        """See `Device`. The action is done once the jaws rest."""
        if not isinstance(goal, ClampGoal):
            raise _foreign("clamp", "ClampGoal", goal)
        return self._turn.take(Request(self._steps(goal.closed)), self.state, self.state)

    def state(self) -> ClampState:
        """Where the jaws stand, as read."""
        return ClampState(self._clamp.travel())

    def _steps(self, closed: bool) -> Iterator[None]:
        values, begin = self._parameters, self._clock.now()
        (self._clamp.close if closed else self._clamp.open)()
        since, stood = begin, self._clamp.travel()
        while self._clock.now() - since < values.still and self._clock.now() - begin < values.seconds:
            yield
            stands = self._clamp.travel()
            if max(abs(a - b) for a, b in zip(stands, stood, strict=True)) > values.moves:
                since, stood = self._clock.now(), stands


def _foreign(device: str, takes: str, goal: object) -> TypeError:
    return TypeError(f"the {device} takes {takes}, not {type(goal).__name__}")
