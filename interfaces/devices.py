"""Devices of a robot cell as protocols. `sim` implements them; drivers of a real cell would do so in its place."""

from typing import Protocol

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.reading import GripperReading, JointReading
from regrasp.interfaces.trajectory import Trajectory

TICK = 0.05  # simulated s between two ticks of a behaviour tree


class Clock(Protocol):
    """The clock of a run; all stamps and timeouts are in its seconds."""

    def now(self) -> float:
        """Seconds since the run began."""
        ...


class Guard(Protocol):
    """What may stop an arm at once. A driver asks it in its servo loop, not only at ticks."""

    def __call__(self, reading: JointReading) -> bool:
        """Whether the arm must stop now."""
        ...

    def greatest_efforts(self) -> FloatArray | None:
        """What the drives may use at most until the next reading, (n,) N m or N; None: all that they can."""
        ...


class Arm(Protocol):
    """An arm with position-controlled joints."""

    name: str

    def reading(self) -> JointReading:
        """The newest encoder reading."""
        ...

    def gravity(self) -> FloatArray:
        """Gravity (3,) m/s2 in the world, as an accelerometer in the arm's base tells it."""
        ...

    def follow(self, trajectory: Trajectory, guard: Guard | None = None) -> None:
        """Start to follow `trajectory` now, in place of one under way. It must begin at the arm's present position.

        When `guard` says so, the arm stops as fast as its drives can, and holds where it stands.
        """
        ...

    def stop(self) -> None:
        """Brake, no joint harder than the acceleration in its robot's file, and hold."""
        ...

    def is_moving(self) -> bool:
        """Whether the arm still executes a trajectory or brakes, by what was commanded, not by measurement."""
        ...


class Gripper(Protocol):
    """A two-finger parallel gripper."""

    def open(self, gap: float) -> None:
        """Move the pads until they are `gap` metres apart."""
        ...

    def close(self, force: float) -> None:
        """Close, and press with `force` newtons on each finger until the next command."""
        ...

    def reading(self) -> GripperReading:
        """The newest reading of the finger encoder."""
        ...


class Camera(Protocol):
    """An RGB-D camera."""

    name: str

    def latest(self) -> RgbdFrame | None:
        """The newest frame whose latency has passed, None before the first. Reading it changes nothing."""
        ...
