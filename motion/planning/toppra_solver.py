"""Time-optimal path parametrization by toppra."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any

import numpy as np
from scipy.interpolate import BPoly

from regrasp.interfaces.arrays import FloatArray


@contextmanager
def _empty_pyplot() -> Iterator[None]:
    """In this context `import matplotlib.pyplot` gives an empty module, unless it has been imported before.

    toppra imports it for plots that nobody here asks for: a second of every run.
    """
    names = ("matplotlib", "matplotlib.pyplot")
    added = {} if names[1] in sys.modules else {name: ModuleType(name) for name in names}
    before = {name: sys.modules[name] for name in added if name in sys.modules}
    for name, module in added.items():
        sys.modules[name] = module
    if added:
        added[names[0]].__dict__["pyplot"] = added[names[1]]
    try:
        yield
    finally:
        for name in added:
            del sys.modules[name]
        sys.modules.update(before)


with _empty_pyplot():
    import toppra
    import toppra.algorithm
    import toppra.constraint

toppra.setup_logging("ERROR")


def time_optimal(curve: BPoly, grid: FloatArray, velocity: FloatArray, acceleration: FloatArray) -> Any:
    """toppra's trajectory along a curve in joint space, at rest at both ends; None where it finds none.

    `grid` (n,) are values of the curve's parameter; `velocity` (n,) and `acceleration` (n,) are limits.
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
        self._joints = int(curve.c.shape[2])

    def __call__(self, s: FloatArray, order: int = 0) -> FloatArray:
        # just inside the end, where the second derivative still belongs to the last piece
        return np.asarray(self._derivatives[order](np.clip(s, 0.0, self._end * (1 - 1e-12))))

    @property
    def dof(self) -> int:
        """Number of joints."""
        return self._joints

    @property
    def path_interval(self) -> FloatArray:
        """Range of the path parameter."""
        return np.array([0.0, self._end])

    @property
    def waypoints(self) -> None:
        """None: the curve is not made from a list of points."""
        return None
