"""Devices without a world, for studies of planning: they stand, or are at once where they shall go."""

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.devices import Guard
from regrasp.interfaces.reading import GripperReading, JointReading
from regrasp.interfaces.trajectory import Trajectory


class StandingArm:
    """An arm device that stands where it was put, and does not move."""

    def __init__(self, name: str, positions: FloatArray) -> None:
        self.name, self.positions = name, positions

    def reading(self) -> JointReading:
        """See `Arm`."""
        still = np.zeros(len(self.positions))
        return JointReading(0.0, self.positions, still, still)

    def gravity(self) -> FloatArray:
        """See `Arm`."""
        return np.zeros(3)

    def follow(self, trajectory: Trajectory, guard: Guard | None = None) -> None:
        """See `Arm`."""

    def stop(self) -> None:
        """See `Arm`."""

    def is_moving(self) -> bool:
        """See `Arm`."""
        return False


class StandingGripper:
    """A gripper device whose jaw stays `gap` m open."""

    def __init__(self, gap: float) -> None:
        self.gap = gap

    def open(self, gap: float) -> None:
        """See `Gripper`."""

    def close(self, force: float) -> None:
        """See `Gripper`."""

    def reading(self) -> GripperReading:
        """See `Gripper`."""
        return GripperReading(0.0, self.gap)


class StandingClock:
    """A clock that stands."""

    def now(self) -> float:
        """See `Clock`."""
        return 0.0


class InstantArm(StandingArm):
    """An arm device that is at a trajectory's end as soon as it follows it."""

    def follow(self, trajectory: Trajectory, guard: Guard | None = None) -> None:
        """See `Arm`."""
        self.positions = trajectory.sample(trajectory.duration)[0]


class RunningClock:
    """A clock that goes on by `tick` s each time that it is told to."""

    def __init__(self, tick: float) -> None:
        self._tick, self._ticks = tick, 0

    def advance(self) -> None:
        """Let a tick pass."""
        self._ticks += 1

    def now(self) -> float:
        """See `Clock`."""
        return self._ticks * self._tick
