"""Distances to the spheres that stand for an arm in collision checks, and those of a camera on it."""

import numba as nb
import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.arrays import FloatArray

# Three spheres cover a camera on an arm: a RealSense measures 0.025 x 0.09 x 0.025 m.
CAMERA_RADIUS = 0.022  # metres
CAMERA_ACROSS = (-0.03, 0.0, 0.03)  # metres along the mount's y axis


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def sphere_distances(points: FloatArray, spheres: FloatArray) -> tuple[FloatArray, NDArray[np.int64]]:
    """Signed distances (n,) m of points (n, 3) to the nearest of the spheres (m, 4), and which sphere (n,) that is."""
    distances, nearest = np.full(len(points), np.inf), np.zeros(len(points), np.int64)
    for n in range(len(points)):
        for m in range(len(spheres)):
            x, y, z = points[n, 0] - spheres[m, 0], points[n, 1] - spheres[m, 1], points[n, 2] - spheres[m, 2]
            distance = np.sqrt(x * x + y * y + z * z) - spheres[m, 3]
            if distance < distances[n]:
                distances[n], nearest[n] = distance, m
    return distances, nearest
