"""Ways round obstacles for a held connector along the shapes that its cable takes by itself.

Without a pull the free end of an elastic cable has two degrees of freedom: how far it is bent to either side
(`natural_poses`). In that plane a grid is searched for the shortest way on which cable and arm are free.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from regrasp.interfaces.arrays import FloatArray, Mask
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.motion.cable.cable_path import natural_poses


@dataclass(frozen=True)
class NaturalRouteParameters:
    """The grid of deflections, and how far the cable keeps from things on it."""

    cell: float = 0.025  # m between two deflections of the grid; choice
    max_share: float = 0.55  # of the cable's length, the greatest deflection; beyond 0.63 no natural shape has it
    clearances: tuple[float, ...] = (0.03, 0.015, 0.006)  # m from the cable's middle line; one route each; choice


class NaturalRoutes:
    """The deflections that a cable's end may have, among obstacles."""

    def __init__(
        self,
        known: CableKnown,
        clearance: Callable[[FloatArray], float],
        parameters: NaturalRouteParameters = NaturalRouteParameters(),
    ) -> None:
        """`clearance` is m from the cable's middle line to anything, by the connector's pose (4, 4)."""
        self._known, self._clearance, self._parameters = known, clearance, parameters
        _, course = known.cable.anchor
        across = np.cross(course, [0.0, 0.0, 1.0] if abs(course[2]) < 0.9 else [1.0, 0.0, 0.0])
        across /= np.linalg.norm(across)
        self._axes = np.stack([across, np.cross(across, course)])  # (2, 3), unit vectors across the straight course
        half = int(parameters.max_share * known.cable.length / parameters.cell)
        steps = parameters.cell * np.arange(-half, half + 1)
        self._places = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
        self._count = len(steps)

    @cached_property
    def poses(self) -> FloatArray:
        """world_from_connector (n, 4, 4) at each place of the grid."""
        return natural_poses(self._known, self._places @ self._axes)

    @cached_property
    def _clearances(self) -> FloatArray:
        return np.array([self._clearance(pose) for pose in self.poses])

    def routes(
        self, begin: FloatArray, end: FloatArray, arm_free: Callable[[FloatArray], bool]
    ) -> Iterator[FloatArray]:
        """Deflections (k, 3) m from `begin` (left out) to `end`, both (3,), the route furthest from everything first.

        `arm_free` says whether the arm can hold the connector at a pose (4, 4); only of poses on the shortest ways
        that is asked.
        """
        near = self._clearances >= min(self._parameters.clearances)
        near &= np.linalg.norm(self._places, axis=1) <= self._parameters.max_share * self._known.cable.length
        first, last = self._nearest(begin), self._nearest(end)
        asked: dict[int, bool] = {first: True, last: True}

        def blocked(place: int) -> bool:
            if place not in asked:
                asked[place] = arm_free(self.poses[place])
            return not asked[place]

        before: FloatArray | None = None
        for clearance in self._parameters.clearances:
            free = near & (self._clearances >= clearance)
            free[[first, last]] = True
            route = self._shortest(free, first, last)
            while route is not None and (closed := [place for place in route if blocked(place)]):
                near[closed] = free[closed] = False
                route = self._shortest(free, first, last)
            if route is not None and (before is None or not np.array_equal(route, before)):
                before = route
                yield np.vstack([self._places[route[1:-1]] @ self._axes, end])

    def _nearest(self, deflection: FloatArray) -> int:
        return int(np.argmin(np.linalg.norm(self._places - self._axes @ deflection, axis=1)))

    def _shortest(self, free: Mask, first: int, last: int) -> FloatArray | None:
        """The places (k,) of the shortest way over the `free` (n,) ones, to neighbours and diagonally; None: no way."""
        grid = np.arange(self._count**2).reshape(self._count, self._count)
        pairs = [(grid[1:], grid[:-1], 1.0), (grid[:, 1:], grid[:, :-1], 1.0)]
        pairs += [(grid[1:, 1:], grid[:-1, :-1], np.sqrt(2.0)), (grid[1:, :-1], grid[:-1, 1:], np.sqrt(2.0))]
        rows, columns, lengths = [], [], []
        for a, b, length in pairs:
            both = free[a] & free[b]
            rows.append(a[both])
            columns.append(b[both])
            lengths.append(np.full(both.sum(), length))
        size = self._count**2
        edges = coo_array((np.concatenate(lengths), (np.concatenate(rows), np.concatenate(columns))), (size, size))
        _, before = dijkstra(edges.tocsr(), directed=False, indices=[first], return_predecessors=True)
        came_from = before[0]
        route = [last]
        while route[-1] != first:
            if came_from[route[-1]] < 0:
                return None
            route.append(int(came_from[route[-1]]))
        return np.array(route[::-1])
