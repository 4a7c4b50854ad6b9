"""Groups of spheres with a bounding sphere each, so that a collision check leaves out what is far from everything."""

import numba as nb
import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.arrays import FloatArray

MAX_GROUP = 10  # spheres in a group; choice: a finger's
MAX_GAP = 0.2  # m between the centres of two spheres in a row of a group; choice: keeps an arm's foot plate apart
_SLACK = 1e-6  # m that a bounding sphere is larger: far more than the rounding errors of a check


def group_starts(parts: NDArray[np.int64], spheres: FloatArray) -> NDArray[np.int64]:
    """Where groups of spheres (n, 4) m in a row begin, (g + 1,) with n at the end; a group is of one part."""
    starts, last = [], 0
    for n in range(len(spheres)):
        gap = n and np.linalg.norm(spheres[n, :3] - spheres[n - 1, :3])
        if n == 0 or parts[n] != parts[n - 1] or gap > MAX_GAP or n - last == MAX_GROUP:
            starts.append(n)
            last = n
    return np.array([*starts, len(spheres)], np.int64)


def bounding_spheres(spheres: FloatArray, starts: NDArray[np.int64]) -> FloatArray:
    """Spheres (g, 4) m round those of each group, about the middle of their centres."""
    bounds = np.empty((len(starts) - 1, 4))
    for g in range(len(bounds)):
        group = spheres[starts[g] : starts[g + 1]]
        bounds[g, :3] = 0.5 * (group[:, :3].min(axis=0) + group[:, :3].max(axis=0))
        bounds[g, 3] = np.max(np.linalg.norm(group[:, :3] - bounds[g, :3], axis=1) + group[:, 3]) + _SLACK
    return bounds


def group_pairs(pairs: NDArray[np.int64], starts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Pairs of groups (p, 2) from `pairs` (m, 2) of spheres, of which a group has all with another or none."""
    first, second = np.searchsorted(starts, pairs, side="right").T - 1
    numbers = np.unique(first * len(starts) + second)  # ten times as fast as np.unique of rows
    return np.column_stack(np.divmod(numbers, len(starts)))


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def square_distance(a: FloatArray, b: FloatArray) -> float:
    """Squared distance (m2) of two points (3,)."""
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def groups_meet(spheres, bound, others, other_bound, margin, overlap):  # type: ignore[no-untyped-def]
    """Whether a sphere (n, 4) comes nearer than `margin` less `overlap` to one of `others` (m, 4), by their bounds."""
    if square_distance(bound, other_bound) > max(0.0, bound[3] + margin + other_bound[3]) ** 2:
        return False
    for n in range(spheres.shape[0]):
        for m in range(others.shape[0]):
            if square_distance(spheres[n], others[m]) < (spheres[n, 3] + margin + others[m, 3] - overlap) ** 2:
                return True
    return False
