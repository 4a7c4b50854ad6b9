"""Spheres that cover a solid and stand out of it by no more than a margin."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from regrasp.app.robots.meshes import Triangles
from regrasp.app.robots.solid import Solid
from regrasp.interfaces.arrays import FloatArray, Mask

_GRID = 1e-4  # m to which centres and radii are rounded
_EVERY = 5  # of how many voxels inside one must be held
_BLOCK = 1024  # points whose distances to all spheres are worked out at once


@dataclass(frozen=True)
class FitParameters:
    """How spheres are fitted. Smaller voxels take longer and save spheres: half of their edge is lost of the margin."""

    margin: float = 0.02  # m that a sphere stands out at most
    voxels: float = 2e5  # in the box around the surface, about
    edge: tuple[float, float] = (0.05, 0.25)  # of a voxel at least and at most, as shares of the margin
    candidates: int = 3000  # at most
    points: int = 1000  # that the spheres are chosen by at first, and how many of those left out join them at a time
    tries: int = 4  # greedy choices, all but the first one at random among the best, of which the smallest is kept
    near_best: float = 0.9  # share of the best sphere's gain that another one needs to be chosen in its place
    seed: int = 0


def fit_spheres(
    surface: Triangles, parameters: FitParameters | None = None, covered: FloatArray | None = None
) -> FloatArray:
    """Spheres (n, 4), centre and radius in m, that hold all of a surface and stand out of it by at most the margin.

    About a point c that lies d(c) deep in the solid, a ball of radius d(c) lies inside, so one of radius d(c) +
    margin stands out by at most the margin. Of those balls the greedy algorithm takes, again and again, the one that
    holds most points not yet held (set cover). Only the medial axis is searched: any other inner ball lies in one
    about a point of it (Bradshaw and O'Sullivan, Adaptive medial-axis approximation for sphere-tree construction,
    ACM TOG 23(1), 2004).

    Points of the surface count as held when they lie deeper in a sphere than their spacing, so that what lies
    between them is held, too; points inside count as they are. `covered` (m, 4) are spheres that are there already.
    """
    parameters = parameters or FitParameters()
    solid = _filled(surface, parameters)
    points = _points(solid, np.empty((0, 4)) if covered is None else covered)
    rng = np.random.default_rng(parameters.seed)
    axis = _spheres_about(_some(solid.medial, parameters.candidates, rng), solid, parameters.margin)
    chosen, left = _cover(axis, points, parameters, rng)
    while len(left):  # in corners, and in parts thinner than a voxel
        more, left = _cover(_about(left, solid, parameters, rng), left, parameters, rng)
        chosen = np.concatenate([chosen, more])
    return np.asarray(chosen[_needed(_held(chosen, points))])


def _filled(surface: Triangles, parameters: FitParameters) -> Solid:
    volume = float(np.prod(np.ptp(surface.vertices, axis=0)))
    least, most = (share * parameters.margin for share in parameters.edge)
    pitch = float(np.clip((volume / parameters.voxels) ** (1 / 3), least, most))
    return Solid.of(surface, pitch, 0.5 * pitch)


def _points(solid: Solid, covered: FloatArray) -> FloatArray:
    """What must be held (n, 4): points, and by how much at least."""
    surface = np.insert(solid.samples, 3, solid.spacing, axis=1)
    points = np.concatenate([surface, np.insert(solid.middles[::_EVERY], 3, 0.0, axis=1)])
    return points[~_held(covered, points).any(axis=1)]


def _spheres_about(centers: FloatArray, solid: Solid, margin: float) -> FloatArray:
    """The greatest spheres (n, 4) about these points, rounded so that they keep the margin."""
    rounded = np.round(centers / _GRID) * _GRID
    depths = solid.depths(rounded)
    # A centre on the surface may be rounded out of it, by at most half the diagonal of the rounding's grid.
    radii = np.where(depths > 0, depths + margin, margin - np.linalg.norm(rounded - centers, axis=1))
    return np.column_stack([rounded, np.floor(radii / _GRID + 1e-6) * _GRID])


def _about(left: FloatArray, solid: Solid, parameters: FitParameters, rng: np.random.Generator) -> FloatArray:
    """Spheres (n, 4) that hold some of `left`: about points inside near them, and about themselves."""
    few = _some(left[:, :3], parameters.points, rng)
    apart = cKDTree(few).query(solid.middles, distance_upper_bound=parameters.margin)[0]
    near = _some(solid.middles[np.isfinite(apart)], parameters.candidates, rng)
    return _spheres_about(np.concatenate([near, few]), solid, parameters.margin)


def _some(rows: FloatArray, most: int, rng: np.random.Generator) -> FloatArray:
    return rows if len(rows) <= most else np.asarray(rows[np.sort(rng.choice(len(rows), most, replace=False))])


def _cover(
    spheres: FloatArray, points: FloatArray, parameters: FitParameters, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Few of the spheres (n, 4) that hold all points which any of them holds, and the other points (m, 4).

    They are chosen by a part of the points, to which some of those that they leave out are added, until all are held.
    """
    left: list[FloatArray] = []
    unseen, chosen = rng.permutation(points), np.empty((0, 4))
    held = np.empty((0, len(spheres)), bool)
    while True:
        out = np.flatnonzero(~_held(chosen, unseen).any(axis=1))[: parameters.points]
        if not len(out):
            return chosen, np.concatenate([np.empty((0, 4)), *left])
        new = _held(spheres, unseen[out])
        left.append(unseen[out[~new.any(axis=1)]])
        held = np.concatenate([held, new[new.any(axis=1)]])
        unseen, chosen = np.delete(unseen, out, axis=0), spheres[_best_cover(held, parameters, rng)]


def _held(spheres: FloatArray, points: FloatArray) -> Mask:
    """Which points are held by which spheres (n, s), by at least each point's own measure."""
    held = np.empty((len(points), len(spheres)), bool)
    squares = np.sum(spheres[:, :3] ** 2, axis=1)
    for start in range(0, len(points), _BLOCK):
        block = points[start : start + _BLOCK]
        reach = spheres[:, 3] - block[:, 3:]
        far = np.sum(block[:, :3] ** 2, axis=1)[:, None] + squares - 2 * block[:, :3] @ spheres[:, :3].T
        held[start : start + _BLOCK] = (far <= reach**2) & (reach > 0)
    return held


def _best_cover(held: Mask, parameters: FitParameters, rng: np.random.Generator) -> list[int]:
    """The fewest columns found that hold every row which any column holds."""
    best = _greedy(held, 1.0, rng)
    for _ in range(parameters.tries - 1):
        best = min(best, _greedy(held, parameters.near_best, rng), key=len)
    return best


def _greedy(held: Mask, near_best: float, rng: np.random.Generator) -> list[int]:
    chosen: list[int] = []
    left, gains = np.ones(len(held), bool), held.sum(axis=0)
    while gains.size and gains.max() > 0:
        good = np.flatnonzero(gains >= near_best * gains.max())
        chosen.append(int(good[0] if near_best == 1.0 else rng.choice(good)))
        new = left & held[:, chosen[-1]]
        gains, left = gains - held[new].sum(axis=0), left & ~new
    return [chosen[i] for i in _needed(held[:, chosen])]


def _needed(held: Mask) -> list[int]:
    """The columns without those whose rows others hold, the last ones left out first."""
    counts, kept = held.sum(axis=1), list(range(held.shape[1]))
    for column in reversed(kept[:]):
        if np.all(counts[held[:, column]] > 1):
            counts = counts - held[:, column]
            kept.remove(column)
    return kept
