"""Checks of what callers hand in: each says in a ValueError what is wrong with which argument."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from regrasp.interfaces.arrays import FloatArray

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform


def finite(what: str, values: ArrayLike) -> FloatArray:
    """The values as an array. Raises ValueError if some are NaN or infinite."""
    array = np.asarray(values, float)
    if not np.isfinite(array).all():
        bad = int(np.count_nonzero(~np.isfinite(array)))
        raise ValueError(f"{what}: {bad} of {array.size} numbers are not finite")
    return array


def not_negative(what: str, value: float) -> float:
    """The value. Raises ValueError if it is NaN, infinite or below 0."""
    if not (np.isfinite(value) and value >= 0):
        raise ValueError(f"{what} is {value:g}; give a number from 0 on")
    return value


def positive(what: str, value: float) -> float:
    """The value. Raises ValueError if it is NaN, infinite or not above 0."""
    if not (np.isfinite(value) and value > 0):
        raise ValueError(f"{what} is {value:g}; give a number above 0")
    return value


def rows(what: str, values: ArrayLike, count: int) -> FloatArray:
    """The values as rows (k, `count`); one row may come by itself, and none as an empty list.

    Raises ValueError if the rows have another length, or hold NaN or infinities.
    """
    array = finite(what, values)
    if array.size == 0:
        return np.empty((0, count))
    array = np.atleast_2d(array)
    if array.ndim != 2 or array.shape[1] != count:
        raise ValueError(f"{what} have the shape {array.shape}; give (k, {count})")
    return array


def share(what: str, value: float) -> float:
    """The value. Raises ValueError if it is not above 0 and at most 1."""
    if not 0 < value <= 1:
        raise ValueError(f"{what} is {value:g}; give a number above 0 and at most 1")
    return value


def vector(what: str, values: ArrayLike) -> FloatArray:
    """The values as a vector (3,). Raises ValueError if they are not three finite numbers."""
    array = finite(what, values)
    if array.shape != (3,):
        raise ValueError(f"{what} has the shape {array.shape}; give (3,)")
    return array


def finite_pose(what: str, pose: "RigidTransform") -> None:
    """Raises ValueError if a number of a pose is NaN or infinite."""
    finite(what, pose.as_matrix())
