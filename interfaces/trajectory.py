"""A joint trajectory: a path with times."""

from bisect import bisect_right
from dataclasses import dataclass

from regrasp.interfaces.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Samples: `times` (n,) s, from 0 on and strictly increasing; `positions` (n, 6) rad; `velocities` (n, 6) rad/s."""

    times: FloatArray
    positions: FloatArray
    velocities: FloatArray

    @property
    def duration(self) -> float:
        """Time of the last sample, s."""
        return float(self.times[-1])

    def sample(self, t: float) -> tuple[FloatArray, FloatArray]:
        r"""Position (6,) rad and velocity (6,) rad/s at second `t`, clamped to the first and last sample.

        Between two samples, `h` seconds apart, the path is a cubic Hermite spline:

        .. math:: q(s) = (2s^3 - 3s^2 + 1) p_0 + (s^3 - 2s^2 + s) h v_0 + (3s^2 - 2s^3) p_1 + (s^3 - s^2) h v_1

        with :math:`s = (t - t_0) / h`; the velocity is its derivative.
        """
        if t <= 0.0:
            return self.positions[0], self.velocities[0]
        if t >= self.times[-1]:
            return self.positions[-1], self.velocities[-1]
        i = bisect_right(self.times, t) - 1
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
