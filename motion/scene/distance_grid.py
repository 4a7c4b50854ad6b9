"""Distance field: how far the nearest seen surface is, looked up in a grid of voxels."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

FREE_DISTANCE = 10.0  # metres; what a grid says where nothing is occupied


@dataclass(frozen=True, eq=False)
class DistanceGrid:
    """Distances (m) to the nearest occupied voxel's centre; what is looked up never exceeds the true `least` distance.

    `distance` (nx, ny, nz) float32 m; `lower` (3,) m is the corner of voxel (0, 0, 0) in the world; `h` m is a voxel's
    edge. Outside the grid nothing is known to be occupied. Unseen space counts as free unless it is marked as occupied.
    """

    distance: NDArray[np.float32]
    lower: NDArray[np.float64]
    h: float

    @classmethod
    def from_occupied(
        cls, occupied: NDArray[np.bool_], lower: NDArray[np.float64], h: float, *, least: bool = True
    ) -> "DistanceGrid":
        """Grid of an occupancy array (nx, ny, nz).

        Not the `least` distances are those to the far sides of occupied voxels.
        """
        if not occupied.any():
            return cls(np.full(occupied.shape, FREE_DISTANCE, np.float32), np.asarray(lower, float), h)
        centres = np.asarray(distance_transform_edt(~occupied)) * h
        # A point may lie half a voxel's diagonal off the centre that the transform measured from.
        off = 0.5 * np.sqrt(3.0) * h if least else -0.5 * h
        return cls((centres - off).astype(np.float32), np.asarray(lower, float), h)

    @classmethod
    def from_points(
        cls,
        points: NDArray[np.float64],
        lower: NDArray[np.float64],
        upper: NDArray[np.float64],
        h: float,
        *,
        least: bool = True,
    ) -> "DistanceGrid":
        """Grid over the box `lower`..`upper` (3,) with a voxel occupied where one of the points (n, 3) lies."""
        lower = np.asarray(lower, float)
        shape = np.ceil((np.asarray(upper) - lower) / h).astype(int)
        index = np.floor((np.asarray(points, float).reshape(-1, 3) - lower) / h).astype(int)
        index = index[np.all((index >= 0) & (index < shape), axis=1)]
        occupied = np.zeros(tuple(shape), dtype=np.bool_)
        occupied[tuple(index.T)] = True
        return cls.from_occupied(occupied, lower, h, least=least)

    @classmethod
    def of_boxes(
        cls,
        centers: NDArray[np.float64],
        sizes: NDArray[np.float64],
        yaws: NDArray[np.float64],
        h: float,
        border: float,
    ) -> "DistanceGrid":
        """Grid of the true distances to n boxes, and `border` m round them; they are negative inside.

        `centers` and `sizes` (the edges) are (n, 3) m; each box is turned by its `yaws` (n,) rad about z.
        """
        wide = 0.5 * np.hypot(sizes[:, 0], sizes[:, 1])
        reach = np.column_stack([wide, wide, 0.5 * sizes[:, 2]]) + border
        lower, upper = (centers - reach).min(axis=0), (centers + reach).max(axis=0)
        x, y, z = (np.arange(low, high, h) + 0.5 * h for low, high in zip(lower, upper, strict=True))
        nearest = np.full((len(x), len(y), len(z)), FREE_DISTANCE)
        for center, half, yaw in zip(centers, 0.5 * sizes, yaws, strict=True):
            dx, dy = x[:, None] - center[0], y[None] - center[1]
            along = np.abs(np.cos(yaw) * dx + np.sin(yaw) * dy) - half[0]
            across = np.abs(np.cos(yaw) * dy - np.sin(yaw) * dx) - half[1]
            up = np.abs(z - center[2]) - half[2]
            outside = np.hypot(np.hypot(np.maximum(along, 0), np.maximum(across, 0))[..., None], np.maximum(up, 0))
            inside = np.minimum(np.maximum(np.maximum(along, across)[..., None], up), 0)
            nearest = np.minimum(nearest, outside + inside)
        # A point may lie half a voxel's diagonal off the centre at which the distance is known.
        return cls((nearest - 0.5 * np.sqrt(3.0) * h).astype(np.float32), lower, h)

    def at(self, points: NDArray[np.float64]) -> NDArray[np.float32]:
        """Distances (n,) m at points (n, 3) in world; `FREE_DISTANCE` outside the grid."""
        index = np.floor((points - self.lower) / self.h).astype(int)
        inside = np.all((index >= 0) & (index < self.distance.shape), axis=1)
        found = np.full(len(points), FREE_DISTANCE, np.float32)
        found[inside] = self.distance[tuple(index[inside].T)]
        return found


NO_SURFACES = DistanceGrid(np.full((1, 1, 1), FREE_DISTANCE, np.float32), np.zeros(3), 1e-3)
