"""Joint paths in time: corners rounded, then as fast as the joints' limits allow (toppra)."""

from itertools import pairwise

import numpy as np
import toppra
import toppra.algorithm
import toppra.constraint
from numpy.typing import NDArray
from scipy.interpolate import BPoly

from regrasp.interfaces.trajectory import Trajectory
from regrasp.motion.robots.kinematics import ACCELERATION_LIMIT, VELOCITY_LIMIT, FloatArray

toppra.setup_logging("ERROR")

STOP_TIME = 0.3  # seconds in which an arm that drives by these trajectories can come to rest
CORNER = 0.1  # rad of path on either side of a waypoint that its blend replaces
SAMPLE = 0.015  # seconds between samples; 0.02 after the slowing that a check of the limits may ask for
_SHARE = 0.85  # of the limits, for toppra overshoots accelerations between its grid points
_GRID_STEP = 0.02  # rad of path


class _Path(toppra.interpolator.AbstractGeometricPath):  # type: ignore[misc,unused-ignore]
    """A piecewise polynomial as toppra wants it."""

    def __init__(self, curve: BPoly) -> None:
        self._derivatives = (curve, curve.derivative(), curve.derivative(2))
        self._end = float(curve.x[-1])

    def __call__(self, s: FloatArray, order: int = 0) -> FloatArray:
        # just inside the end, where the second derivative still belongs to the last piece
        return np.asarray(self._derivatives[order](np.clip(s, 0.0, self._end * (1 - 1e-12))))

    @property
    def dof(self) -> int:
        """Number of joints."""
        return 6

    @property
    def path_interval(self) -> FloatArray:
        """Range of the path parameter."""
        return np.array([0.0, self._end])

    @property
    def waypoints(self) -> None:
        """None: there is no list of points behind the curve."""
        return None


def time_path(path: NDArray[np.float64], speed: float = 1.0) -> Trajectory:
    """Trajectory along the joint path (k, 6) rad, at rest at both ends; it cuts corners by at most `CORNER` / 2 rad.

    `speed` in (0, 1] slows the whole motion down in proportion. Velocities stay low enough to stop within `STOP_TIME`.
    """
    path = np.asarray(path, float).reshape(-1, 6)
    path = path[np.append(True, np.abs(np.diff(path, axis=0)).max(axis=1) > 1e-9)]
    if len(path) == 1:
        return Trajectory(np.zeros(1), path.copy(), np.zeros((1, 6)))
    curve = _blended(path)
    velocity = _SHARE * np.minimum(VELOCITY_LIMIT, ACCELERATION_LIMIT * STOP_TIME)
    acceleration = _SHARE * ACCELERATION_LIMIT
    constraints = [
        toppra.constraint.JointVelocityConstraint(np.column_stack([-velocity, velocity])),
        toppra.constraint.JointAccelerationConstraint(np.column_stack([-acceleration, acceleration])),
    ]
    algorithm = toppra.algorithm.TOPPRA(
        constraints, _Path(curve), gridpoints=_grid(curve.x), parametrizer="ParametrizeConstAccel"
    )
    timed = algorithm.compute_trajectory(0, 0)
    if timed is None:
        raise RuntimeError(f"toppra found no timing for a path of {len(path)} waypoints")
    count = max(2, int(np.ceil(timed.duration / (speed * SAMPLE))) + 1)
    t = np.linspace(0.0, float(timed.duration), count)
    positions, velocities = timed(t), timed(t, 1)
    velocities[[0, -1]] = 0.0
    slower = max(1.0, _overshoot(t, positions, velocities)) / speed
    return Trajectory(t * slower, positions, velocities / slower)


def brake(q: FloatArray, qd: FloatArray) -> Trajectory:
    """Trajectory from joints (6,) rad at speed (6,) rad/s to rest, all joints at once, within the acceleration limits.

    It takes at most `STOP_TIME` when the speed came from `time_path`.
    """
    q, qd = np.asarray(q, float), np.asarray(qd, float)
    duration = float(np.max(np.abs(qd) / ACCELERATION_LIMIT))
    if duration < 1e-6:
        return Trajectory(np.zeros(1), q[None].copy(), np.zeros((1, 6)))
    t = np.linspace(0.0, duration, max(2, int(np.ceil(duration / SAMPLE)) + 1))
    rest = 1 - t / duration
    positions = q + np.outer(t * (1 + rest) / 2, qd)
    return Trajectory(t, positions, np.outer(rest, qd))


def _blended(path: FloatArray) -> BPoly:
    """The path with its corners replaced by parabolas, parametrised by length (continuous first derivative)."""
    pieces, breaks, here = [], [0.0], path[0]

    def add(middle: FloatArray, end: FloatArray, length: float) -> None:
        if length > 1e-9:
            pieces.append((here, middle, end))
            breaks.append(breaks[-1] + length)

    for before, corner, after in zip(path[:-2], path[1:-1], path[2:], strict=True):
        lengths = float(np.linalg.norm(corner - before)), float(np.linalg.norm(after - corner))
        cut = min(CORNER, 0.5 * lengths[0], 0.5 * lengths[1])
        entry = corner + (before - corner) * (cut / lengths[0])
        leave = corner + (after - corner) * (cut / lengths[1])
        add((here + entry) / 2, entry, float(np.linalg.norm(entry - here)))
        here = entry
        add(corner, leave, 2 * cut)
        here = leave
    add((here + path[-1]) / 2, path[-1], float(np.linalg.norm(path[-1] - here)))
    return BPoly(np.array(pieces).transpose(1, 0, 2), np.array(breaks))


def _grid(breaks: FloatArray) -> FloatArray:
    """Grid points of the path parameter: the pieces' ends and at least three points within each piece."""
    parts = [np.linspace(a, b, max(4, int(np.ceil((b - a) / _GRID_STEP))), endpoint=False) for a, b in pairwise(breaks)]
    return np.append(np.concatenate(parts), breaks[-1])


def _overshoot(t: FloatArray, positions: FloatArray, velocities: FloatArray) -> float:
    """Factor by which time must be stretched so that the interpolated samples keep the full limits."""
    h = np.diff(t)[:, None]
    slope, v0, v1 = np.diff(positions, axis=0) / h, velocities[:-1], velocities[1:]
    # A cubic's acceleration is largest at an end of its interval.
    acceleration = np.abs([6 * slope - 4 * v0 - 2 * v1, 2 * v0 + 4 * v1 - 6 * slope]) / h
    velocity = np.abs(velocities) / np.minimum(VELOCITY_LIMIT, ACCELERATION_LIMIT * STOP_TIME)
    return max(float(velocity.max()), float(np.sqrt((acceleration / ACCELERATION_LIMIT).max())))
