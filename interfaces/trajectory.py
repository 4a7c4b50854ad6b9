"""A joint trajectory: a path with times."""

from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from regrasp.interfaces.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Samples: `times` (k,) s, from 0 on and strictly increasing; `positions` (k, n); `velocities` (k, n) a second."""

    times: FloatArray
    positions: FloatArray
    velocities: FloatArray

    @cached_property
    def duration(self) -> float:
        """Time of the last sample, s."""
        return float(self.times[-1])

    def sample(self, t: float) -> tuple[FloatArray, FloatArray]:
        r"""Positions and velocities (n,) at second `t`, clamped to the first and last sample.

        Between two samples, `h` seconds apart, the path is a cubic Hermite spline:

        .. math:: q(s) = (2s^3 - 3s^2 + 1) p_0 + (s^3 - 2s^2 + s) h v_0 + (3s^2 - 2s^3) p_1 + (s^3 - s^2) h v_1

        with :math:`s = (t - t_0) / h`; the velocity is its derivative.
        """
        if t <= 0.0:
            return self.positions[0], self.velocities[0]
        if t >= self.times[-1]:
            return self.positions[-1], self.velocities[-1]
        i = bisect_right(self.times, t) - 1
        begin = self.times[i]
        s = float((t - begin) / (self.times[i + 1] - begin))
        both = np.array((1.0, s, s * s, s * s * s)) @ self._polynomials[i]
        joints = both.size // 2
        return both[:joints], both[joints:]

    @cached_property
    def _polynomials(self) -> FloatArray:
        """Coefficients (k - 1, 4, 2 n) of 1, s, s^2 and s^3 in each interval: of the position, then of the velocity."""
        h = np.diff(self.times)[:, None]
        rise = self.positions[1:] - self.positions[:-1]
        m0, m1 = h * self.velocities[:-1], h * self.velocities[1:]
        square, cube = 3 * rise - 2 * m0 - m1, m0 + m1 - 2 * rise
        position = np.stack([self.positions[:-1], m0, square, cube], axis=1)
        velocity = np.stack([m0, 2 * square, 3 * cube, np.zeros_like(cube)], axis=1) / h[:, None]
        return np.concatenate([position, velocity], axis=2)
