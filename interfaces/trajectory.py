"""A timed joint path."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Joint samples: `times` (n,) s from 0, strictly increasing; `positions`, `velocities` (n, 6) rad, rad/s."""

    times: FloatArray
    positions: FloatArray
    velocities: FloatArray

    @property
    def duration(self) -> float:
        """Seconds from the first sample to the last."""
        return float(self.times[-1])

    def sample(self, t: float) -> tuple[FloatArray, FloatArray]:
        """Position (6,) rad and velocity (6,) rad/s at second `t`: cubic Hermite pieces, clamped at the ends."""
        if t <= 0.0:
            return self.positions[0], self.velocities[0]
        if t >= self.times[-1]:
            return self.positions[-1], self.velocities[-1]
        i = int(np.searchsorted(self.times, t, side="right")) - 1
        h = float(self.times[i + 1] - self.times[i])
        s = (t - float(self.times[i])) / h
        p0, p1 = self.positions[i], self.positions[i + 1]
        m0, m1 = h * self.velocities[i], h * self.velocities[i + 1]
        position = (
            (2 * s**3 - 3 * s**2 + 1) * p0
            + (s**3 - 2 * s**2 + s) * m0
            + (3 * s**2 - 2 * s**3) * p1
            + (s**3 - s**2) * m1
        )
        velocity = ((6 * s**2 - 6 * s) * (p0 - p1) + (3 * s**2 - 4 * s + 1) * m0 + (3 * s**2 - 2 * s) * m1) / h
        return position, velocity
