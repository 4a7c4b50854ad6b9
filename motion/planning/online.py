"""Online trajectory generation: the tool's way to a goal that may move, planned anew while it is under way."""

from dataclasses import dataclass

import numpy as np
from ruckig import InputParameter, Result, Ruckig, RuckigError, Synchronization, Trajectory
from scipy.spatial.transform import Rotation

from regrasp.interfaces.arrays import FloatArray


@dataclass(frozen=True)
class OnlineParameters:
    """How fast the tool goes relative to its goal, in each of its axes and about each."""

    speed: float = 0.20  # m/s; choice
    acceleration: float = 0.5  # m/s2; choice
    jerk: float = 4.0  # m/s3; choice
    turn_speed: float = 0.5  # rad/s; choice
    turn_acceleration: float = 1.5  # rad/s2; choice
    turn_jerk: float = 12.0  # rad/s3; choice
    fine: float = 0.025  # s between the samples of ...
    fine_time: float = 0.2  # s at the beginning, which are driven before the next plan ...
    rest: int = 8  # and the samples of what comes after; choice


@dataclass(frozen=True, eq=False)
class ToolSamples:
    """Poses (k, 4, 4) of the tool, world_from_tool, at `times` (k,) s."""

    times: FloatArray
    poses: FloatArray


class OnlinePlanner:
    r"""Leads a tool to a goal that moves evenly, with limited speed, acceleration and jerk relative to it.

    It plans the offset from the goal :math:`p(t) - g(t)` to zero (Ruckig: Berscheid, Kröger 2021, "Jerk-limited
    Real-time Trajectory Generation with Arbitrary Target States"), and the rotation vector from the goal's orientation
    likewise. `pose` (4, 4) is where the tool rests at first, world_from_tool.
    """

    def __init__(self, pose: FloatArray, parameters: OnlineParameters = OnlineParameters()) -> None:
        self._parameters = parameters
        self._ruckig, self._input = Ruckig(6), InputParameter(6)
        values, three = parameters, [1.0] * 3
        for name, along, about in (
            ("max_velocity", values.speed, values.turn_speed),
            ("max_acceleration", values.acceleration, values.turn_acceleration),
            ("max_jerk", values.jerk, values.turn_jerk),
        ):
            setattr(self._input, name, [along * x for x in three] + [about * x for x in three])
        self._input.target_position = [0.0] * 6
        self._place, self._turn = pose[:3, 3], Rotation.from_matrix(pose[:3, :3])
        self._rates = np.zeros((2, 6))  # velocity and acceleration in the world
        self._plan: Trajectory | None = None
        self._goal, self._goal_turn, self._drift = self._place, self._turn, np.zeros(3)

    def advance(self, elapsed: float) -> None:
        """Take it that the tool followed the last plan for `elapsed` s."""
        if self._plan is None:
            return
        offset, velocity, acceleration = (np.array(x) for x in self._plan.at_time(elapsed))
        self._place = self._goal + self._drift * elapsed + offset[:3]
        self._turn = self._goal_turn * Rotation.from_rotvec(offset[3:])
        self._rates = np.array([velocity, acceleration])
        self._rates[0, :3] += self._drift

    def replan(self, goal: FloatArray, drift: FloatArray) -> ToolSamples:
        """The way from where the tool is to a goal (4, 4), world_from_tool, that drifts with (3,) m/s.

        Raises:
            ValueError: there is none within the limits.
        """
        self._goal, self._goal_turn, self._drift = goal[:3, 3], Rotation.from_matrix(goal[:3, :3]), drift
        offset = np.concatenate([self._place - self._goal, (self._goal_turn.inv() * self._turn).as_rotvec()])
        rates = self._rates.copy()
        rates[0, :3] -= drift
        self._input.current_position = offset.tolist()
        self._input.current_velocity, self._input.current_acceleration = rates.tolist()
        self._plan = self._trajectory()
        return self._samples(self._plan)

    def _trajectory(self) -> Trajectory:
        """All axes arrive together; where Ruckig's arithmetic fails at that, each as soon as it can."""
        failures = []
        for synchronization in (Synchronization.Phase, Synchronization.No):
            self._input.synchronization, trajectory = synchronization, Trajectory(6)
            try:
                result = self._ruckig.calculate(self._input, trajectory)
            except RuckigError as error:
                failures.append(str(error))
                continue
            if result in (Result.Working, Result.Finished):
                return trajectory
            failures.append(str(result))
        raise ValueError(f"no way to the goal: {failures[-1]}")

    def _samples(self, plan: Trajectory) -> ToolSamples:
        values, left = self._parameters, plan.duration - self._parameters.fine_time
        times = np.linspace(0.0, values.fine_time, round(values.fine_time / values.fine) + 1)
        if left > values.fine:
            count = min(values.rest, int(left / values.fine))
            times = np.append(times, np.linspace(values.fine_time, plan.duration, count + 1)[1:])
        offsets = np.array([plan.at_time(float(t))[0] for t in times])
        turns = self._goal_turn * Rotation.from_rotvec(offsets[:, 3:])
        poses = np.tile(np.eye(4), (len(times), 1, 1))
        poses[:, :3, :3] = turns.as_matrix()
        poses[:, :3, 3] = self._goal + times[:, None] * self._drift + offsets[:, :3]
        return ToolSamples(times, poses)
