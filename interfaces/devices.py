"""What a robot cell offers to the software above it. `sim` fulfils these; a real cell would too."""

from typing import Protocol

from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.reading import GripperReading, JointReading
from regrasp.interfaces.trajectory import Trajectory

TICK = 0.05  # simulated s between two ticks of a behaviour tree


class Clock(Protocol):
    """The one clock."""

    def now(self) -> float:
        """Seconds since the run began."""
        ...


class Arm(Protocol):
    """A six-joint arm with position servos."""

    name: str

    def reading(self) -> JointReading:
        """The newest encoder reading."""
        ...

    def follow(self, trajectory: Trajectory) -> None:
        """Start to follow a trajectory now; it replaces one under way. It must begin where the arm is."""
        ...

    def stop(self) -> None:
        """Brake within the joints' acceleration limits and hold."""
        ...

    def is_moving(self) -> bool:
        """Whether a trajectory or a braking is under way (commanded, not measured)."""
        ...


class Gripper(Protocol):
    """A two-finger parallel gripper."""

    def open(self, gap: float) -> None:
        """Drive the pads to a distance of `gap` metres."""
        ...

    def close(self, force: float) -> None:
        """Drive the pads together and press with `force` newtons a finger until told otherwise."""
        ...

    def reading(self) -> GripperReading:
        """The newest finger reading."""
        ...


class Camera(Protocol):
    """An RGB-D camera."""

    name: str

    def latest(self) -> RgbdFrame | None:
        """The newest frame whose latency has passed, the same however often it is asked for; None before the first."""
        ...
