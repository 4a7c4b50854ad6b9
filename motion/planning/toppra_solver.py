"""Time-optimal path parametrization by toppra. Importing this brings matplotlib, so `timing` imports it late."""

from typing import Any

import numpy as np
import toppra
import toppra.algorithm
import toppra.constraint
from scipy.interpolate import BPoly

from regrasp.interfaces.arrays import FloatArray

toppra.setup_logging("ERROR")


def time_optimal(curve: BPoly, grid: FloatArray, velocity: FloatArray, acceleration: FloatArray) -> Any:
    """toppra's trajectory along a curve in joint space, at rest at both ends; None where it finds none.

    `grid` (n,) are values of the curve's parameter; `velocity` (6,) rad/s and `acceleration` (6,) rad/s2 are limits.
    """
    constraints = [
        toppra.constraint.JointVelocityConstraint(np.column_stack([-velocity, velocity])),
        toppra.constraint.JointAccelerationConstraint(np.column_stack([-acceleration, acceleration])),
    ]
    algorithm = toppra.algorithm.TOPPRA(
        constraints, _Path(curve), gridpoints=grid, parametrizer="ParametrizeConstAccel"
    )
    return algorithm.compute_trajectory(0, 0)


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
        """None: the curve is not made from a list of points."""
        return None
