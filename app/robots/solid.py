"""A surface filled: which points lie inside it, and how deep."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from regrasp.app.robots.meshes import Triangles
from regrasp.interfaces.arrays import FloatArray, Mask

_AXIS = 0.1  # share of the way between two voxels by which an inner ball may stand out of the other one's and lie in it
_NEAREST = 0.01  # share of a depth by which it is understated; on the axis many samples are about as near


@dataclass(frozen=True, eq=False)
class Solid:
    """A surface with what it encloses, as voxels.

    Robust to meshes that are open by less than a voxel, or made of shells that cut one another: a voxel is enclosed
    if it lies between voxels of the surface along each of the three axes. That also fills a pocket whose mouth no axis
    leads out of. Surfaces that others enclose do not count.

    `samples` (n, 3) are points of the outer surface, of which none lies farther than `spacing` m from the nearest of
    them. `inside` (x, y, z) says which voxels are enclosed and lie off that surface; voxel (0, 0, 0) has its middle
    at `corner` (3,) m, and `pitch` m is the edge of a voxel.
    """

    samples: FloatArray
    spacing: float
    pitch: float
    corner: FloatArray
    inside: Mask

    @classmethod
    def of(cls, surface: Triangles, pitch: float, spacing: float) -> "Solid":
        """Fill a surface by voxels of edge `pitch` m; `spacing` m is that of the samples, at most half the pitch."""
        samples = surface.samples(spacing)
        corner = samples.min(axis=0) - 2 * pitch
        cells = tuple(np.rint((samples - corner) / pitch).astype(np.int64).T)
        # The surface's voxels with their neighbours: all that it comes near, so that nothing leaks through it.
        near = _grown(_marked(cells, (*(int(axis.max()) + 3 for axis in cells),)))
        outer = _grown(~_between(near), 2)[cells]
        on_surface = _grown(_marked(tuple(axis[outer] for axis in cells), near.shape))
        return cls(samples[outer], spacing, pitch, corner, _between(near) & ~on_surface)

    @cached_property
    def tree(self) -> "cKDTree[None]":
        """For the nearest sample."""
        return cKDTree(self.samples)

    @cached_property
    def middles(self) -> FloatArray:
        """The middles (n, 3) of the voxels inside."""
        return np.asarray(self.corner + self.pitch * np.argwhere(self.inside))

    @cached_property
    def medial(self) -> FloatArray:
        """The middles (n, 3) of those voxels inside whose inner ball lies in no neighbour's.

        To within the size of a voxel they are the medial axis.
        """
        depths = np.pad(ndimage.distance_transform_edt(self.inside), 1)
        kept, core = self.inside.copy(), (slice(1, -1),) * 3
        for step in np.argwhere(np.ones((3, 3, 3))) - 1:
            if step.any():
                other = np.roll(depths, step, axis=(0, 1, 2))
                kept &= ~((other - depths >= (1 - _AXIS) * np.linalg.norm(step)) & (other > depths))[core]
        return np.asarray(self.corner + self.pitch * np.argwhere(kept))

    def depths(self, points: FloatArray) -> FloatArray:
        """How far (n,) m points (n, 3) inside lie from the surface at least; 0 for those that may lie outside."""
        distances = np.asarray(self.tree.query(points, eps=_NEAREST)[0]) / (1 + _NEAREST)
        return np.asarray(np.where(self.holds(points), np.maximum(distances - self.spacing, 0.0), 0.0))

    def outside(self, points: FloatArray) -> FloatArray:
        """How far (n,) m points (n, 3) lie outside, to within the spacing; 0 for those inside."""
        return np.asarray(np.where(self.holds(points), 0.0, self.tree.query(points)[0]))

    def holds(self, points: FloatArray) -> Mask:
        """Which points (n, 3) lie in a voxel that is inside."""
        cells = np.rint((points - self.corner) / self.pitch).astype(np.int64)
        on_grid = np.all((cells >= 0) & (cells < self.inside.shape), axis=1)
        held = np.zeros(len(points), bool)
        held[on_grid] = self.inside[tuple(cells[on_grid].T)]
        return held


def _marked(cells: tuple[NDArray[np.int64], ...], shape: tuple[int, ...]) -> Mask:
    marked = np.zeros(shape, bool)
    marked[cells] = True
    return marked


def _grown(marked: Mask, voxels: int = 1) -> Mask:
    return np.asarray(ndimage.binary_dilation(marked, np.ones((3, 3, 3), bool), iterations=voxels))


def _between(near: Mask) -> Mask:
    """Which voxels (x, y, z) have one of `near` before and behind them along each axis."""
    result = np.ones_like(near)
    for axis in range(3):
        before = np.logical_or.accumulate(near, axis=axis)
        behind = np.flip(np.logical_or.accumulate(np.flip(near, axis), axis=axis), axis)
        result &= before & behind
    return result
