"""What goes wrong, caused by the world: the tree is not told."""

import numpy as np
from numpy.typing import NDArray

from interfaces.scene import JawOpens
from sim.gripper import SimGripper


class JawOpensFault:
    """Watches the held end's way from `start` to `goal` (3,) m and opens the jaw once."""

    def __init__(
        self, fault: JawOpens, gripper: SimGripper, start: NDArray[np.float64], goal: NDArray[np.float64]
    ) -> None:
        self._fault, self._gripper = fault, gripper
        self._start, self._way = start, goal - start
        self.fired_at: float | None = None

    def step(self, now: float, connector: NDArray[np.float64], held: bool) -> None:
        """Open the jaw when the end, held and out of its socket, has come far enough."""
        if self.fired_at is not None or not held:
            return
        share = float((connector - self._start) @ self._way) / float(self._way @ self._way)
        if share >= self._fault.carried:
            self._gripper.fail_open(self._fault.seconds)
            self.fired_at = now
