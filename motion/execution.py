"""Trajectory execution: lets arms follow and jaws open, watches them, and puts what does not follow out of order."""

from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.devices import Arm, Clock, Gripper
from regrasp.interfaces.evidence import Evidence
from regrasp.interfaces.quote import arm_words
from regrasp.interfaces.robot.chain import Chain
from regrasp.interfaces.trajectory import Trajectory
from regrasp.motion.failure import GraspEmptyError, JawBlockedError, PlanningError, StoppedShortError, TouchError
from regrasp.motion.grasping.gap_test import GapParameters, GripWatch
from regrasp.motion.planning.timing import JointLimits, PathSpeed, TimingParameters, time_path
from regrasp.motion.request import MotionRequest
from regrasp.motion.robots.arm_watch import ArmWatch, ArmWatchParameters, remaining_waypoints
from regrasp.motion.robots.contact_guard import (
    ContactGuard,
    ContactGuardParameters,
    ContactLimits,
    Touch,
)
from regrasp.motion.robots.dynamics import ArmDynamics


@dataclass(frozen=True)
class GripParameters:
    """How a jaw closes on a thing."""

    force: float = 40.0  # N a finger; choice
    time: float = 1.0  # s; the jaw closes from 60 mm at 0.1 m/s a finger, and the readings settle
    attempts: int = 3  # times that a jaw which does not move is told to close; choice
    moved: float = 0.003  # m that a jaw must move to count as moved: three times the encoder's backlash
    gentle_force: float = 5.0  # N a finger with which a jaw closes at first on a thing that lies free; choice
    gentle_time: float = 0.6  # s that it has for that; choice
    wider: float = 0.008  # m; one that then stands so much wider than the thing pinches something else too; choice
    gap: GapParameters = field(default_factory=GapParameters)


@dataclass(frozen=True)
class JawParameters:
    """How a jaw opens and closes."""

    open_gap: float = 0.05  # m between the pads: 15 mm to each side of the connector; poses err by about 8 mm
    slack: float = 0.005  # m short of its gap that a jaw counts as open; choice
    tolerance: float = 0.003  # m off its gap that a jaw counts as there: three times the encoder's backlash
    attempts: int = 3  # times that a jaw is told to open; choice
    timeout: float = 1.0  # s that it has each time; choice
    grip: GripParameters = field(default_factory=GripParameters)


@dataclass(frozen=True)
class BackOffParameters:
    """How an arm goes back the way that it came after a touch."""

    distance: float = 0.10  # m at least that its far end moves, where the elbow moves by less than half; choice
    seconds: float = 1.0  # s of its way at least: so long a slow arm may press before that is felt; choice
    step: float = 0.02  # s of the way that it came between two waypoints
    speed: float = 0.3  # share of the joints' speed; choice


@dataclass(frozen=True)
class ExecutionParameters:
    """How a trajectory's execution is judged and repeated."""

    goal_tolerance: float = 0.05  # rad; an arm that rests further from its goal was blocked; choice
    settle_time: float = 0.10  # s after a trajectory's end before the arm's position is judged; choice
    arrival_timeout: float = 1.0  # s that a late arm then has to reach the goal; choice
    attempts: int = 3  # times that an arm which does not follow is led on; choice
    slowdown: float = 0.5  # factor on the speed for every attempt after the first; choice
    retry_pause: float = 1.0  # s before the next attempt; what jams may come free
    jaw: JawParameters = field(default_factory=JawParameters)
    back_off: BackOffParameters = field(default_factory=BackOffParameters)
    same_place: float = 0.01  # rad or m; an arm that reads this near to its last command stands there
    watch: ArmWatchParameters = field(default_factory=ArmWatchParameters)
    guard: ContactGuardParameters = field(default_factory=ContactGuardParameters)
    timing: TimingParameters = field(default_factory=TimingParameters)


class Separation(PathSpeed, Protocol):
    """How far an arm is from what it could touch."""

    def near(self, q: FloatArray) -> bool:
        """Whether something is near where the arm's joints (n,) are."""
        ...


class Execution:
    """Carries out motions of the arms on the simulated clock; planning one takes `latency` s.

    An arm or jaw that fails is out of order: from then on every request to it fails with the same cause. `on_anomaly`
    is told, in a sentence, of an arm or a jaw that does not follow.
    """

    def __init__(
        self,
        arms: Mapping[str, Arm],
        grippers: Mapping[str, Gripper],
        chains: Mapping[str, Chain],
        dynamics: Mapping[str, ArmDynamics],
        clock: Clock,
        latency: float,
        parameters: ExecutionParameters = ExecutionParameters(),
        on_anomaly: Callable[[str], None] = lambda sentence: None,
    ) -> None:
        self.parameters, self._on_anomaly = parameters, on_anomaly
        self._arms, self._grippers, self._clock, self._latency = arms, grippers, clock, latency
        self._chains, self._dynamics = chains, dynamics
        self._watches = {name: ArmWatch(name, chains[name], parameters.watch) for name in arms}
        self._limits = {name: JointLimits(chains[name].speeds, chains[name].accelerations) for name in arms}
        self._commanded: dict[str, FloatArray] = {}  # where an arm was told to come to rest
        self._speed_share = dict.fromkeys(arms, 1.0)  # of the speed asked for; less for an arm that fell behind
        self._held_back: set[str] = set()  # arms that something elastic seems to hold
        self._out_of_order: dict[str, PlanningError] = {}

    def request(self, arm: str, steps: Iterator[None]) -> MotionRequest:
        """The steps as a request to an arm. It raises the arm's cause at its first poll if that is out of order."""

        def guarded() -> Iterator[None]:
            if arm in self._out_of_order:
                raise self._out_of_order[arm]
            yield from steps

        return MotionRequest(guarded(), lambda: self.halt(arm))

    def halt(self, arm: str) -> None:
        """Stop an arm where it is."""
        self._arms[arm].stop()
        self._commanded.pop(arm, None)
        self._watches[arm].leave(None)

    def give_up(self, arm: str, code: str, message: str) -> PlanningError:
        """Put an arm or its jaw out of order with this cause; the error is for the caller to raise."""
        self._on_anomaly(f"{message}: out of order")
        self._out_of_order[arm] = PlanningError(code, message)
        return self._out_of_order[arm]

    def follow(
        self,
        arm: str,
        path: FloatArray,
        speed: float,
        contact: ContactLimits | None = None,
        separation: Separation | None = None,
    ) -> Iterator[None]:
        """Steps that bring an arm along a joint path (k, n), at `speed` in (0, 1] of the joints' limits.

        Slower, and stopped by less, where the `separation` from other things is small.

        An arm that falls behind is stopped and led on, slower each time. One that touches something stops at once and
        goes a little way back; `contact` says what counts as a touch (default: of an arm that moves freely). Raises
        TouchError then, PlanningError ARM_FAILED when it never follows or its encoder readings are implausible, and
        StoppedShortError when it ends off its goal, or never follows while something elastic may hold it back.
        """
        limits = contact or self.parameters.guard.free
        yield from self._follow(arm, self._from_command(arm, path), speed, limits, separation)

    def _follow(
        self, arm: str, path: FloatArray, speed: float, contact: ContactLimits, separation: Separation | None = None
    ) -> Iterator[None]:
        moved = self._watches[arm].moved_alone(self._arms[arm].reading())
        if moved is not None:
            raise self.give_up(arm, CauseCode.ARM_FAILED, moved)
        for _ in range(self.parameters.attempts):
            of_limits, timing = speed * self._speed_share[arm], self.parameters.timing
            trajectory = time_path(path, self._limits[arm], of_limits, timing, separation)
            yield from self._pause(self._latency)
            guard = self._guard(arm, contact, separation)
            trouble, elapsed = yield from self._run(arm, trajectory, guard)
            if guard.touch is not None:
                self._on_anomaly(felt := self._felt(arm, guard.touch))
                if contact.back_off:
                    with suppress(StoppedShortError):
                        yield from self._back_off(arm, trajectory, elapsed)
                raise TouchError(felt, guard.touch)
            if trouble is None:
                break
            self.halt(arm)
            self._on_anomaly(trouble)
            if contact.elastic:
                speed *= self.parameters.slowdown  # in this motion only: what held the arm back may have come free then
            else:
                self._speed_share[arm] *= self.parameters.slowdown
            path = remaining_waypoints(path, trajectory.sample(elapsed)[0])
            yield from self._pause(self.parameters.retry_pause)
            path = np.vstack([self._joints(arm), path])
        else:
            message = f"{trouble}, {self.parameters.attempts} times"
            if contact.elastic:
                self._held_back.add(arm)
                raise StoppedShortError(message)
            raise self.give_up(arm, CauseCode.ARM_FAILED, message)
        self._held_back.discard(arm)
        self._commanded[arm] = path[-1]
        yield from self._arrive(arm, path[-1])
        self._watches[arm].leave(self._joints(arm))

    def held_back(self, arm: str) -> bool:
        """Whether something elastic seems to have held an arm back in its last motion, and no other has ended since."""
        return arm in self._held_back

    def standing(self, arm: str) -> FloatArray:
        """The joints (n,) at which an arm at rest stands: those it was told where it was left, else as read."""
        return self._from_command(arm, self._joints(arm)[None])[0]

    def stream(
        self,
        arm: str,
        trajectories: Iterator[Trajectory | None],
        contact: ContactLimits,
        separation: Separation | None = None,
    ) -> Iterator[None]:
        """Steps that let an arm follow one trajectory after the other, asked for at every tick; None keeps the last.

        Each must begin where the arm is told to be then, and as fast. When there are no more, or it fails, the arm
        brakes. Raises TouchError when the arm touches something, ARM_FAILED for implausible readings, StoppedShortError
        when it does not follow, and what the trajectories raise.
        """
        guard, watch, under_way, begun = self._guard(arm, contact, separation), self._watches[arm], None, 0.0
        watch.begin()
        watch.leave(None)
        try:
            for trajectory in trajectories:
                if trajectory is not None:
                    self._arms[arm].follow(trajectory, guard)
                    under_way, begun = trajectory, self._clock.now()
                yield
                reading = self._arms[arm].reading()
                if guard.touch is not None:
                    self._on_anomaly(felt := self._felt(arm, guard.touch))
                    raise TouchError(felt, guard.touch)
                if (jumped := watch.jumped(reading)) is not None:
                    raise self.give_up(arm, CauseCode.ARM_FAILED, jumped)
                if under_way is not None:
                    trouble = watch.off_trajectory(reading, under_way, self._clock.now() - begun)
                    if trouble is not None:
                        raise StoppedShortError(trouble)
        finally:
            self.halt(arm)
        while self._arms[arm].is_moving():
            yield
        watch.leave(self._joints(arm))

    def open_jaw(self, arm: str, gap: float) -> Iterator[None]:
        """Steps that open a jaw until its fingers read `gap` m. Raises PlanningError GRIPPER_FAILED if they do not."""
        gripper, jaw = self._grippers[arm], self.parameters.jaw
        for _ in range(jaw.attempts):
            gripper.open(jaw.open_gap)
            end = self._clock.now() + jaw.timeout
            while self._clock.now() < end - 1e-9:
                if gripper.reading().gap >= gap:
                    return
                yield
        message = f"the {arm} jaw stands {1e3 * gripper.reading().gap:.1f} mm open, told {jaw.attempts} times to open"
        raise self.give_up(arm, CauseCode.GRIPPER_FAILED, f"{message} to {1e3 * jaw.open_gap:.0f} mm")

    def set_jaw(self, arm: str, gap: float) -> Iterator[None]:
        """Steps that bring a jaw's pads `gap` m from each other.

        Raises PlanningError MOTION_BLOCKED when something stops them on the way, and GRIPPER_FAILED when they do not
        move at all.
        """
        gripper, jaw = self._grippers[arm], self.parameters.jaw
        before = gripper.reading().gap
        for _ in range(jaw.attempts):
            gripper.open(gap)
            end = self._clock.now() + jaw.timeout
            while self._clock.now() < end - 1e-9:
                yield
                if abs(gripper.reading().gap - gap) < jaw.tolerance:
                    return
        stands = gripper.reading().gap
        message = (
            f"the {arm} jaw stands {1e3 * stands:.1f} mm open, told {jaw.attempts} times to go to {1e3 * gap:.1f} mm"
        )
        if abs(stands - before) < jaw.grip.moved:
            raise self.give_up(arm, CauseCode.GRIPPER_FAILED, message)
        raise PlanningError(CauseCode.MOTION_BLOCKED, message)

    def press_jaw(self, arm: str, force: float) -> Iterator[None]:
        """Steps that close a jaw until it presses with `force` N a finger, on whatever is between its pads."""
        self._grippers[arm].close(force)
        yield from self._pause(self.parameters.jaw.grip.time)

    def close_jaw(
        self, arm: str, thickness: float, gently: bool = False, force: float | None = None
    ) -> Generator[None, None, float]:
        """Close a jaw on a thing of `thickness` m, with `force` N a finger (default: as set).

        Returns the gap (m) at which it holds.

        `gently`: with little force at first, and with all of it only once it stands about as wide as the thing.
        Raises GraspEmptyError when it closes on nothing, JawBlockedError when it closes gently on something that is
        wider, and PlanningError GRIPPER_FAILED when it does not move.
        """
        gripper, grip = self._grippers[arm], self.parameters.jaw.grip
        before = gripper.reading().gap
        if gently:
            gap = (yield from self._close(arm, thickness, grip.gentle_force, grip.gentle_time)).value
            if thickness + grip.wider < gap < before - grip.moved:
                raise JawBlockedError(f"the jaw met something beside: it stands {1e3 * gap:.1f} mm open", gap)
        for _ in range(grip.attempts):
            evidence = yield from self._close(arm, thickness, grip.force if force is None else force, grip.time)
            stood = evidence.detected and evidence.value > before - grip.moved
            if not stood:
                break
        if stood and before < thickness - grip.moved:
            raise GraspEmptyError(f"the jaw closed on nothing: it stood {1e3 * before:.1f} mm open before")
        if stood:
            message = f"the {arm} jaw stands {1e3 * evidence.value:.1f} mm open, told {grip.attempts} times to close"
            raise self.give_up(arm, CauseCode.GRIPPER_FAILED, message)
        if evidence.detected:
            raise GraspEmptyError(f"the jaw closed on nothing: {evidence.sentence}")
        return evidence.value

    def _close(self, arm: str, thickness: float, force: float, seconds: float) -> Generator[None, None, Evidence]:
        """Close a jaw with `force` N a finger; whether it holds nothing after these seconds, by the gap of its pads."""
        self._grippers[arm].close(force)
        watch = GripWatch(self._grippers[arm], thickness, self.parameters.jaw.grip.gap)
        end = self._clock.now() + seconds
        while self._clock.now() < end - 1e-9:
            evidence = watch.evidence()
            yield
        return evidence

    def _from_command(self, arm: str, path: FloatArray) -> FloatArray:
        """The path from where the servos stand: a start by the encoders' reading jerks what the hand holds."""
        stands = self._commanded.pop(arm, None)
        if stands is None or np.max(np.abs(path[0] - stands)) > self.parameters.same_place:
            return path
        return np.vstack([stands, path[1:]])

    def _guard(self, arm: str, contact: ContactLimits, separation: Separation | None) -> ContactGuard:
        near = None if separation is None else separation.near
        return ContactGuard(self._dynamics[arm], self._arms[arm].gravity(), self._chains[arm].torques, contact, near)

    def _back_off(self, arm: str, trajectory: Trajectory, elapsed: float) -> Iterator[None]:
        """Steps that bring an arm back the way that it came, as far as the parameters say.

        Raises as `follow` does; what the arm touched or the cable may hold it back, so it is never put out of order
        for falling behind.
        """
        path, way, levers, values = [self._joints(arm)], 0.0, self._chains[arm].levers, self.parameters.back_off
        touched = elapsed
        while elapsed > 0.0 and (way < values.distance or elapsed > touched - values.seconds):
            elapsed -= values.step
            path.append(trajectory.sample(elapsed)[0])
            way += float(np.linalg.norm((path[-1] - path[-2]) * levers))
        if way > 0.0:
            yield from self._follow(arm, np.array(path), values.speed, ContactLimits(np.inf, elastic=True))

    def _felt(self, arm: str, touch: Touch) -> str:
        joint = int(np.argmax(np.abs(touch.efforts) / self._chains[arm].torques))
        name, unit = self._chains[arm].names[joint].replace("_", " "), "N" if self._chains[arm].slides[joint] else "N m"
        return (
            f"{arm_words(arm)} touched something: its {name} felt {abs(touch.efforts[joint]):.1f} {unit} from outside"
        )

    def _run(
        self, arm: str, trajectory: Trajectory, guard: ContactGuard
    ) -> Generator[None, None, tuple[str | None, float]]:
        """Let the arm follow; why it was found off the trajectory, if it was, and after how many seconds."""
        watch, start = self._watches[arm], self._clock.now()
        watch.begin()
        watch.leave(None)
        self._arms[arm].follow(trajectory, guard)
        while self._arms[arm].is_moving():
            yield
            reading, elapsed = self._arms[arm].reading(), self._clock.now() - start
            if guard.touch is not None:
                return None, guard.touch.stamp - start
            jumped = watch.jumped(reading)
            if jumped is not None:
                self.halt(arm)
                raise self.give_up(arm, CauseCode.ARM_FAILED, jumped)
            trouble = watch.off_trajectory(reading, trajectory, elapsed)
            if trouble is not None:
                return trouble, elapsed
        return None, trajectory.duration

    def _arrive(self, arm: str, goal: FloatArray) -> Iterator[None]:
        """Wait until the arm rests at `goal` (n,). Raises PlanningError when it does not come there."""
        yield from self._pause(self.parameters.settle_time)
        end, tolerance = self._clock.now() + self.parameters.arrival_timeout, self.parameters.goal_tolerance
        while self._goal_error(arm, goal) > tolerance and self._clock.now() < end - 1e-9:
            yield
        error = self._goal_error(arm, goal)
        if error > tolerance:
            message = f"{arm_words(arm)} stopped {error:.2f} rad short of its goal, more than {tolerance:.2f}"
            raise StoppedShortError(message)

    def _goal_error(self, arm: str, goal: FloatArray) -> float:
        return float(np.max(np.abs(self._joints(arm) - goal)))

    def _joints(self, arm: str) -> FloatArray:
        return self._arms[arm].reading().positions

    def _pause(self, seconds: float) -> Iterator[None]:
        end = self._clock.now() + seconds
        while self._clock.now() < end - 1e-9:
            yield
