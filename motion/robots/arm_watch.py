"""Does an arm do as it is told? Its encoder readings against the trajectory that it follows."""

import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.reading import JointReading
from regrasp.interfaces.trajectory import Trajectory

JOINTS = ("waist", "shoulder", "elbow", "forearm roll", "wrist angle", "wrist rotate")
BEHIND = 0.08  # rad off the trajectory: without a fault or a contact it is 0.004
JUMP = 0.05  # rad between two readings beyond what the velocities allow: without a fault it is 0.002
NEAR_READINGS = 0.11  # s between readings that are held against each other
LEFT = 0.10  # rad off the place where the arm was left: without a fault it is 0.005, leaning on something 0.04


class ArmWatch:
    """Watches one arm while it follows a trajectory. `name` is for the sentences."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._last: JointReading | None = None
        self._left: NDArray[np.float64] | None = None

    def begin(self) -> None:
        """A trajectory begins."""
        self._last = None

    def leave(self, joints: NDArray[np.float64] | None) -> None:
        """The arm rests at these joints (6,) rad; None: nobody knows where it comes to rest."""
        self._left = joints

    def moved_alone(self, reading: JointReading) -> str | None:
        """A sentence when the arm is not where it was left."""
        if self._left is None:
            return None
        return self._beyond(reading.positions - self._left, LEFT, "from where it was left")

    def jumped(self, reading: JointReading) -> str | None:
        """A sentence when a reading and the one before it cannot both be true."""
        last, self._last = self._last, reading
        if last is None or not 0.0 < reading.stamp - last.stamp < NEAR_READINGS:
            return None
        fastest = np.maximum(np.abs(reading.velocities), np.abs(last.velocities))
        step = np.abs(reading.positions - last.positions)
        return self._beyond(np.maximum(step - fastest * (reading.stamp - last.stamp), 0.0), JUMP, "more than it turned")

    def behind(self, reading: JointReading, trajectory: Trajectory, elapsed: float) -> str | None:
        """A sentence when the arm is not where the trajectory is after `elapsed` s."""
        return self._beyond(reading.positions - trajectory.sample(elapsed)[0], BEHIND, "off its trajectory")

    def _beyond(self, off: NDArray[np.float64], limit: float, what: str) -> str | None:
        joint = int(np.argmax(np.abs(off)))
        if abs(off[joint]) <= limit:
            return None
        return f"the {self._name} arm's {JOINTS[joint]} reads {abs(off[joint]):.2f} rad {what}, limit {limit:.2f}"


def rest_of(path: NDArray[np.float64], reached: NDArray[np.float64]) -> NDArray[np.float64]:
    """The waypoints (n, 6) of a joint path (k, 6) that lie ahead of `reached` (6,), a place on it or near."""
    begins, ways = path[:-1], np.diff(path, axis=0)
    shares = np.einsum("ij,ij->i", reached - begins, ways) / np.maximum(np.einsum("ij,ij->i", ways, ways), 1e-12)
    nearest = begins + np.clip(shares, 0.0, 1.0)[:, None] * ways
    return path[int(np.argmin(np.linalg.norm(nearest - reached, axis=1))) + 1 :]
