"""Execution monitoring: an arm's encoder readings against the trajectory that it follows."""

from dataclasses import dataclass

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.quote import arm_words
from regrasp.interfaces.reading import JointReading
from regrasp.interfaces.robot.chain import Chain
from regrasp.interfaces.trajectory import Trajectory


@dataclass(frozen=True)
class ArmWatchParameters:
    """Limits on encoder readings; each stands well above what is measured without a fault.

    On a rail, m take the place of rad; an arm's tool moves by about as much.
    """

    tracking_error: float = 0.08  # rad off the trajectory; without a fault or a contact it is 0.004
    jump: float = 0.05  # rad between two readings beyond what the velocities allow; without a fault it is 0.002
    max_reading_interval: float = 0.11  # s between two readings that are compared
    resting_drift: float = 0.10  # rad off where the arm was left; without a fault 0.005, leaning on something 0.04


class ArmWatch:
    """Watches one arm while it follows a trajectory. `name` and `chain` are the arm's, for the sentences."""

    def __init__(self, name: str, chain: Chain, parameters: ArmWatchParameters = ArmWatchParameters()) -> None:
        self._name, self._chain, self._parameters = name, chain, parameters
        self._last: JointReading | None = None
        self._resting_at: FloatArray | None = None

    def begin(self) -> None:
        """Begin a new trajectory: the next reading is compared with no earlier one."""
        self._last = None

    def leave(self, joints: FloatArray | None) -> None:
        """Note that the arm rests at these joints (n,); None when it is not known where it comes to rest."""
        self._resting_at = joints

    def moved_alone(self, reading: JointReading) -> str | None:
        """A message if the arm is no longer where it was left, else None."""
        if self._resting_at is None:
            return None
        return self._beyond(
            reading.positions - self._resting_at, self._parameters.resting_drift, "from where it was left"
        )

    def jumped(self, reading: JointReading) -> str | None:
        """A message if this reading and the one before it contradict each other, else None.

        Between two readings a joint turns no further than the faster of its two velocities allows.
        """
        last, self._last = self._last, reading
        if last is None or not 0.0 < reading.stamp - last.stamp < self._parameters.max_reading_interval:
            return None
        fastest = np.maximum(np.abs(reading.velocities), np.abs(last.velocities))
        step = np.abs(reading.positions - last.positions)
        excess = np.maximum(step - fastest * (reading.stamp - last.stamp), 0.0)
        return self._beyond(excess, self._parameters.jump, "more than it turned")

    def off_trajectory(self, reading: JointReading, trajectory: Trajectory, elapsed: float) -> str | None:
        """A message if the arm is not where the trajectory is after `elapsed` s, else None."""
        error = reading.positions - trajectory.sample(elapsed)[0]
        return self._beyond(error, self._parameters.tracking_error, "off its trajectory")

    def _beyond(self, error: FloatArray, limit: float, what: str) -> str | None:
        worst = int(np.argmax(np.abs(error)))
        if abs(error[worst]) <= limit:
            return None
        joint, unit = self._chain.names[worst].replace("_", " "), "m" if self._chain.slides[worst] else "rad"
        return f"{arm_words(self._name)}'s {joint} reads {abs(error[worst]):.3f} {unit} {what} (at most {limit:.3f})"


def remaining_waypoints(path: FloatArray, reached: FloatArray) -> FloatArray:
    """The waypoints (m, n) of a joint path (k, n) that lie ahead of `reached` (n,), a place on it or near it."""
    starts, segments = path[:-1], np.diff(path, axis=0)
    lengths_sq = np.maximum(np.einsum("ij,ij->i", segments, segments), 1e-12)
    shares = np.einsum("ij,ij->i", reached - starts, segments) / lengths_sq
    nearest = starts + np.clip(shares, 0.0, 1.0)[:, None] * segments
    return path[int(np.argmin(np.linalg.norm(nearest - reached, axis=1))) + 1 :]
