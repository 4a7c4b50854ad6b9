"""Time parametrization of joint paths: corners are rounded, then the joints move as fast as their limits allow."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np
from scipy.interpolate import BPoly
from scipy.ndimage import minimum_filter1d

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.trajectory import Trajectory
from regrasp.motion.planning.toppra_solver import time_optimal


@dataclass(frozen=True)
class TimingParameters:
    """How a joint path is turned into a trajectory."""

    stop_time: float = 0.3  # s in which an arm can brake to rest from any speed of the trajectory (spec of a safe stop)
    corner: float = 0.1  # rad of path on either side of a waypoint that its blend replaces
    sample: float = 0.015  # s between samples; up to 0.02 after the slowing that the check of the limits may ask for
    limit_share: float = 0.85  # of the limits; toppra overshoots accelerations between its grid points
    grid_step: float = 0.02  # rad of path between two grid points at most
    thinned: tuple[int, ...] = (1, 2, 3)  # with each so many'th waypoint it is tried, if it fails with more; choice
    least_turn: float = 1e-3  # rad or m that a waypoint left out may lie beside the line of its neighbours; choice
    same_place: float = 1e-6  # rad or m in each joint; of waypoints that are nearer the later stands for both; choice


@dataclass(frozen=True, eq=False)
class JointLimits:
    """The joints' speeds (n,) rad/s and accelerations (n,) rad/s2, of a rail m/s and m/s2."""

    speeds: FloatArray
    accelerations: FloatArray

    def braking_within(self, seconds: float) -> FloatArray:
        """The speeds (n,) from which the joints brake in that time."""
        return np.asarray(np.minimum(self.speeds, self.accelerations * seconds))


class PathSpeed(Protocol):
    """How fast an arm may go along a path, by where it is."""

    def __call__(self, path: FloatArray, slopes: FloatArray) -> FloatArray:
        """The greatest rates (k,) 1/s of the path's parameter; infinity where any is right.

        `path` (k, n) are the joints at k values of the parameter, `slopes` (k, n) their derivatives by it.
        """
        ...


def time_path(
    path: FloatArray,
    limits: JointLimits,
    speed: float = 1.0,
    parameters: TimingParameters = TimingParameters(),
    allowed: PathSpeed | None = None,
) -> Trajectory:
    r"""Trajectory along the joint path (k, n), at rest at both ends; it cuts corners by at most `corner` / 2 rad.

    `speed` in (0, 1] slows the whole motion down in proportion. Only where that is too fast do the rates that are
    `allowed` slow it down further. Raises RuntimeError where no timing is found.

    Along the blended path :math:`q(s)` it finds the fastest :math:`s(t)` (TOPP-RA, Pham and Pham 2018) with

    .. math:: |q'(s) \dot s| \le v_{max}, \quad |q'(s) \ddot s + q''(s) \dot s^2| \le a_{max},
        \quad \dot s \le \dot s_{max}(q, q')
    """
    path = np.asarray(path, float).reshape(-1, len(limits.speeds))
    fastest = limits.braking_within(parameters.stop_time)
    # toppra finds no timing along pieces of 1e-8 rad, as where an arm that has all but come to rest goes back
    path = path[np.append(np.abs(np.diff(path, axis=0)).max(axis=1) > parameters.same_place, True)]
    if len(path) == 1:
        return Trajectory(np.zeros(1), path.copy(), np.zeros(path.shape))
    velocity = parameters.limit_share * fastest
    acceleration = parameters.limit_share * limits.accelerations
    for every in parameters.thinned:
        # toppra's solver finds none along some smooth lines of many waypoints, and one along half of them (measured)
        some = path if every == 1 else path[np.unique(np.append(np.arange(0, len(path), every), len(path) - 1))]
        curve = _blended(some, parameters.corner)
        grid = _grid(curve.x, parameters.grid_step)
        rates = None if allowed is None else _rates(curve, grid, allowed, speed)
        timed = time_optimal(curve, grid, velocity, acceleration, rates)
        if timed is not None or _turns(path, every) > parameters.least_turn:
            break
    if timed is None:
        raise RuntimeError(f"toppra found no timing for a path of {len(path)} waypoints")
    count = max(2, int(np.ceil(timed.duration / (speed * parameters.sample))) + 1)
    t = np.linspace(0.0, float(timed.duration), count)
    positions, velocities = timed(t), timed(t, 1)
    velocities[[0, -1]] = 0.0
    stretch = max(1.0, _overshoot(t, positions, velocities, fastest, limits.accelerations)) / speed
    return Trajectory(t * stretch, positions, velocities / stretch)


def _turns(path: FloatArray, every: int) -> float:
    """How far a waypoint of a path (k, n) lies beside the line of those `every` before and after it, at most."""
    if len(path) <= 2 * every:
        return np.inf
    middle = 0.5 * (path[: -2 * every] + path[2 * every :])
    return float(np.abs(path[every:-every] - middle).max())


def _rates(curve: BPoly, grid: FloatArray, allowed: PathSpeed, speed: float) -> FloatArray | None:
    """The rates (k,) 1/s that are allowed at the grid points before `speed` stretches time; None where all are.

    What holds at a grid point holds up to the next ones on either side: surfaces are not met at grid points only.
    """
    rates = allowed(curve(grid), curve.derivative()(grid)) / speed
    return minimum_filter1d(rates, 3, mode="nearest") if np.isfinite(rates).any() else None


def _blended(path: FloatArray, max_cut: float) -> BPoly:
    """The path with its corners replaced by parabolas, parametrised by length (continuous first derivative).

    A parabola begins and ends `max_cut` rad from its corner, and nearer where the path's segments are short.
    """
    pieces, breaks, here = [], [0.0], path[0]

    def add(middle: FloatArray, end: FloatArray, length: float) -> None:
        if length > 1e-9:
            pieces.append((here, middle, end))
            breaks.append(breaks[-1] + length)

    for before, corner, after in zip(path[:-2], path[1:-1], path[2:], strict=True):
        lengths = float(np.linalg.norm(corner - before)), float(np.linalg.norm(after - corner))
        cut = min(max_cut, 0.5 * lengths[0], 0.5 * lengths[1])
        entry = corner + (before - corner) * (cut / lengths[0])
        leave = corner + (after - corner) * (cut / lengths[1])
        add((here + entry) / 2, entry, float(np.linalg.norm(entry - here)))
        here = entry
        add(corner, leave, 2 * cut)
        here = leave
    add((here + path[-1]) / 2, path[-1], float(np.linalg.norm(path[-1] - here)))
    return BPoly(np.array(pieces).transpose(1, 0, 2), np.array(breaks))


def _grid(breaks: FloatArray, step: float) -> FloatArray:
    """Grid points of the path parameter: the pieces' ends and at least three points within each piece."""
    parts = [np.linspace(a, b, max(4, int(np.ceil((b - a) / step))), endpoint=False) for a, b in pairwise(breaks)]
    return np.append(np.concatenate(parts), breaks[-1])


def _overshoot(
    t: FloatArray, positions: FloatArray, velocities: FloatArray, fastest: FloatArray, hardest: FloatArray
) -> float:
    """Factor by which time must be stretched so that the interpolated samples keep the full limits (n,).

    Stretching time by f divides velocities by f and accelerations by f^2.
    """
    h = np.diff(t)[:, None]
    slope, v0, v1 = np.diff(positions, axis=0) / h, velocities[:-1], velocities[1:]
    # A cubic's acceleration is largest at an end of its interval.
    acceleration = np.abs([6 * slope - 4 * v0 - 2 * v1, 2 * v0 + 4 * v1 - 6 * slope]) / h
    velocity = np.abs(velocities) / fastest
    return max(float(velocity.max()), float(np.sqrt((acceleration / hardest).max())))
