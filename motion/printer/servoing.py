"""Visual servoing: the hand goes to a target by what its camera sees on the way, and follows it if it moves."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.devices import Clock
from regrasp.interfaces.printer.cause import PrinterCause
from regrasp.interfaces.printer.target import TargetEstimate, TargetTracker
from regrasp.interfaces.quote import near_words
from regrasp.interfaces.trajectory import Trajectory
from regrasp.motion.failure import PlanningError
from regrasp.motion.planning.following import FollowingParameters, followed
from regrasp.motion.planning.online import OnlineParameters, OnlinePlanner, ToolSamples
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.robots.poses import rotation_vector
from regrasp.motion.scene.collision import CollisionModel


@dataclass(frozen=True)
class ServoParameters:
    """When the hand has come to its goal, and how it comes there."""

    tolerance: float = 0.0012  # m; choice: a third of what the source's best approach errs
    angle: float = 0.010  # rad
    deviation: float = 0.0015  # m, of the target's estimate at most; choice
    steady: float = 0.3  # s for which all that holds; choice
    corridor: float = 0.004  # m beside the goal's axis within which the hand goes on along it; choice
    funnel: float = 2.0  # m before the goal for each m that it is further beside; choice
    most_before: float = 0.10  # m; choice: from there fingers 0.05 m long do not reach the target
    # m before the target's front from where its last place and velocity are trusted: nearer than 3 mm the fingers hide
    # a part of it, and its front is measured up to 8 mm too far away
    blind: float = 0.015
    lost: float = 1.0  # s without a picture that shows the target; a sound camera needs 0.1
    timeout: float = 20.0  # s; without a fault it takes 3
    fastest: float = 0.10  # m/s of a target that the hand still follows; choice: half of its own speed
    stop_margin: float = 0.004  # m that a way keeps from everything: the arm errs by 2 mm, its rail by 1 mm
    following: FollowingParameters = field(default_factory=FollowingParameters)
    online: OnlineParameters = field(default_factory=OnlineParameters)


class Servo:
    """Plans an arm's way to a target anew with every tick. The arm's rail stands.

    The goal lies `before` m before the target's front, on the target's x axis, and the tool is turned as the target is.
    """

    def __init__(
        self,
        kin: ArmKinematics,
        start: FloatArray,
        target: TargetTracker,
        before: float,
        clock: Clock,
        model: CollisionModel,
        parameters: ServoParameters = ServoParameters(),
    ) -> None:
        self._kin, self._target, self._before = kin, target, before
        self._joints, self._speeds = start, np.zeros(len(start))
        self._clock, self._model, self._parameters = clock, model, parameters
        self._online = OnlinePlanner(kin.tool_matrix(start), parameters.online)
        self.goal: FloatArray | None = None  # the last one (4, 4), world_from_tool
        self.off = np.inf  # m from it
        self.target_speed = 0.0  # m/s, as last seen

    def trajectories(
        self, tool: Callable[[], FloatArray], done_there: Callable[[], bool] = lambda: True
    ) -> Iterator[Trajectory | None]:
        """A trajectory for each tick, None to keep the last one, until the tool has come to the goal.

        `tool` gives world_from_tool (4, 4) as read. Once the tool is there it follows the goal on until `done_there`,
        which is then asked at every tick. Raises PlanningError with TARGET_NOT_SEEN, CAMERA_FAILED,
        TARGET_TOO_FAST, TIMED_OUT, PLANNING_FAILED, OUT_OF_REACH or MOTION_BLOCKED.
        """
        values, begin = self._parameters, self._clock.now()
        planned, plan, steady_since, seen, near, arrived = begin, None, None, None, False, False
        while True:
            now = self._clock.now()
            if not near:
                seen = self._target.update()
            if not near and now - (begin if seen is None else seen.stamp) > values.lost:
                why, trouble = f"the target was not seen for {values.lost:g} s", self._target.trouble
                if trouble is not None:
                    raise PlanningError(CauseCode.CAMERA_FAILED, f"{why}: {trouble}")
                raise PlanningError(PrinterCause.TARGET_NOT_SEEN, f"{why}: {self._target.why}")
            if not arrived and now - begin > values.timeout:
                why = f"the hand did not come to rest at the target in {values.timeout:g} s"
                raise PlanningError(CauseCode.TIMED_OUT, f"{why}: {1e3 * self.off:.1f} mm are left")
            if seen is None:
                yield None
                continue
            self.target_speed = float(np.linalg.norm(seen.velocity))
            if self.target_speed > values.fastest:
                why = f"the target moves with {self.target_speed:.2f} m/s, the hand follows {values.fastest:g} m/s"
                raise PlanningError(PrinterCause.TARGET_TOO_FAST, why)
            goal = self._goal(seen, now)
            there = self._there(seen, goal, tool())
            near = near or self._before - float(goal[:3, 0] @ (tool()[:3, 3] - goal[:3, 3])) < values.blind
            steady_since = (now if steady_since is None else steady_since) if there else None
            arrived = arrived or (steady_since is not None and now - steady_since > values.steady)
            if arrived and done_there():
                return
            if plan is not None:
                self._online.advance(now - planned)
                self._joints, self._speeds = plan.sample(now - planned)
            aim = self._aim(goal, tool())
            try:
                plan = self._way(aim, seen.velocity)
            except PlanningError:
                # The velocity of a target that was just seen is known badly: it may lead on into something.
                plan = self._way(aim, np.zeros(3))
            planned = now
            yield plan

    def _goal(self, seen: TargetEstimate, now: float) -> FloatArray:
        """world_from_tool (4, 4) where it shall be now."""
        self.goal = seen.pose.copy()
        self.goal[:3, 3] += seen.velocity * (now - seen.stamp) - self._before * seen.pose[:3, 0]
        return self.goal

    def _there(self, seen: TargetEstimate, goal: FloatArray, tool: FloatArray) -> bool:
        values, turn = self._parameters, rotation_vector(goal[:3, :3].T @ tool[:3, :3])
        self.off = float(np.linalg.norm(tool[:3, 3] - goal[:3, 3]))
        near = self.off < values.tolerance and float(np.linalg.norm(turn)) < values.angle
        return near and seen.deviation < values.deviation

    def _aim(self, goal: FloatArray, tool: FloatArray) -> FloatArray:
        """Where to go now: before the goal, as long as the tool is beside its axis."""
        values, left = self._parameters, goal[:3, :3].T @ (tool[:3, 3] - goal[:3, 3])
        beside = max(float(np.hypot(left[1], left[2])) - values.corridor, 0.0)
        aim = goal.copy()
        aim[:3, 3] -= min(values.funnel * beside, values.most_before) * goal[:3, 0]
        return aim

    def _way(self, aim: FloatArray, drift: FloatArray) -> Trajectory:
        """To a pose (4, 4) that drifts with (3,) m/s; raises PlanningError where the arm cannot go there."""
        try:
            return self._trajectory(self._online.replan(aim, drift))
        except ValueError as error:
            raise PlanningError(CauseCode.PLANNING_FAILED, str(error)) from error

    def _trajectory(self, samples: ToolSamples) -> Trajectory:
        """The joints along the tool's way. Raises PlanningError where the arm cannot follow or would meet something."""
        values, kin = self._parameters, self._kin
        positions = followed(kin, self._joints, samples.poses, values.following)
        velocities = np.gradient(positions, samples.times, axis=0)
        velocities[0] = self._speeds
        if not self._model.path_free(positions, values.stop_margin):
            distance, what = min(self._model.nearest(q) for q in positions)
            why = f"on its way to the target the arm {near_words(distance, what)}"
            raise PlanningError(CauseCode.MOTION_BLOCKED, why)
        return Trajectory(samples.times, positions, velocities)
