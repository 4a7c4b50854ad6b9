"""What a hand goes to: where its target is, and how it moves."""

from dataclasses import dataclass
from typing import Protocol

from regrasp.interfaces.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class TargetEstimate:
    """The middle of the front of what a hand shall take, as it was at `stamp` s.

    `pose` (4, 4) is world_from_target: x points into it, z up. `velocity` (3,) m/s in the world. `deviation` (m, each
    axis) and `yaw_deviation` (rad) are standard deviations.
    """

    stamp: float
    pose: FloatArray
    velocity: FloatArray
    deviation: float
    yaw_deviation: float


class TargetTracker(Protocol):
    """Follows a target from picture to picture."""

    why: str  # why the last picture told nothing
    trouble: str | None  # why the camera is not to be trusted now

    def update(self) -> TargetEstimate | None:
        """The target by the newest picture; None before it was seen."""
        ...
