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

_ANY_RATE = 1e3  # 1/s of the path's parameter, rad: more than any joint turns; toppra's solver takes no infinity


def time_optimal(
    curve: BPoly, grid: FloatArray, velocity: FloatArray, acceleration: FloatArray, rates: FloatArray | None = None
) -> Any:
    """toppra's trajectory along a curve in joint space, at rest at both ends; None where it finds none.

    `grid` (k,) are values of the curve's parameter; `velocity` (n,) and `acceleration` (n,) are limits, and so are
    `rates` (k,), if given: of the parameter, 1/s.
    """
    constraints = [
        toppra.constraint.JointVelocityConstraint(np.column_stack([-velocity, velocity])),
        toppra.constraint.JointAccelerationConstraint(np.column_stack([-acceleration, acceleration])),
    ]
    if rates is not None:
        constraints.append(_RateConstraint(rates))
    algorithm = toppra.algorithm.TOPPRA(
        constraints, _Path(curve), gridpoints=grid, parametrizer="ParametrizeConstAccel"
    )
    return algorithm.compute_trajectory(0, 0)


class _RateConstraint(toppra.constraint.LinearConstraint):  # type: ignore[misc,unused-ignore]
    """Limits (k,) 1/s on the rate of the path's parameter at the grid points."""

    def __init__(self, rates: FloatArray) -> None:
        super().__init__()
        self._squares = np.minimum(rates, _ANY_RATE) ** 2

    def compute_constraint_params(self, path: Any, gridpoints: FloatArray) -> tuple[FloatArray | None, ...]:
        """What toppra asks of a constraint; of seven terms only the bounds on the square of the rate are there."""
        return (None,) * 6 + (np.column_stack([np.zeros(len(gridpoints)), self._squares]),)


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
