"""Compiled triangles: which surface each pixel of a picture, or each texel of a shadow map, sees first.

A corner is a row (x, y, z, a): the pixel that shows it is (x / z, y / z), and a / z is what grows towards the viewer.
A camera's z is the depth, and a is 1; a light's z is 1, and a falls along its rays. The corners p, q, r of a triangle
give the planes e = (q x r, r x p, p x q). A pixel (u, v, 1) lies in the triangle where all of them have the sign of
p . (q x r), and e . (u, v, 1) / (p . (q x r)) are the weights, over z, of its corners there. This holds for corners
behind the viewer too, so that no triangle need be cut.
"""

from math import ceil, floor

import numba
import numpy as np
from numpy.typing import NDArray


@numba.njit(cache=True, nogil=True, error_model="numpy")
def place_corners(
    local: NDArray[np.float32],
    items: NDArray[np.int64],
    first_corner: NDArray[np.int64],
    poses: NDArray[np.float32],
    light_from_world: NDArray[np.float32],
    places: NDArray[np.float32],
    normals: NDArray[np.float32],
) -> None:
    """Write the items' corners (n, 6), as from `triangle_corners`, as places in the world and normals in the light."""
    for item in items:
        pose = poses[item]
        turn = light_from_world @ np.ascontiguousarray(pose[:, :3])
        for i in range(first_corner[item], first_corner[item + 1]):
            x, y, z, nx, ny, nz = local[i]
            for k in range(3):
                places[i, k] = pose[k, 0] * x + pose[k, 1] * y + pose[k, 2] * z + pose[k, 3]
                normals[i, k] = turn[k, 0] * nx + turn[k, 1] * ny + turn[k, 2] * nz


@numba.njit(cache=True, nogil=True, error_model="numpy")
def project_corners(
    places: NDArray[np.float32],
    items: NDArray[np.int64],
    first_corner: NDArray[np.int64],
    matrix: NDArray[np.float64],
    corners: NDArray[np.float64],
) -> None:
    """Write the items' corners (n, 6): x, y, z, a by the view's `matrix` (4, 4), and the pixel that shows them."""
    for item in items:
        for i in range(first_corner[item], first_corner[item + 1]):
            x, y, z = float(places[i, 0]), float(places[i, 1]), float(places[i, 2])
            for k in range(4):
                corners[i, k] = matrix[k, 0] * x + matrix[k, 1] * y + matrix[k, 2] * z + matrix[k, 3]
            corners[i, 4] = corners[i, 0] / corners[i, 2]
            corners[i, 5] = corners[i, 1] / corners[i, 2]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def draw_triangles(
    corners: NDArray[np.float64],
    items: NDArray[np.int64],
    first_triangle: NDArray[np.int64],
    triangles: NDArray[np.int32],
    near: float,
    nearest: NDArray[np.float32],
    seen: NDArray[np.int32] | None,
) -> None:
    """Draw the items' triangles that face the viewer and are not nearer than z = `near`.

    `nearest` (H, W) holds the largest a / z so far, and `seen` (H, W) the number of the triangle that has it.
    """
    height, width = nearest.shape
    for item in items:
        for t in range(first_triangle[item], first_triangle[item + 1]):
            p, q, r = corners[triangles[t, 0]], corners[triangles[t, 1]], corners[triangles[t, 2]]
            top, bottom = 0, height - 1
            cut = p[2] < near or q[2] < near or r[2] < near
            if not cut:
                left, right = _extent(p[4], q[4], r[4])
                upper, lower = _extent(p[5], q[5], r[5])
                if not (right >= 0.0 and lower >= 0.0 and left <= width - 1 and upper <= height - 1):
                    continue
                if ceil(left) > floor(right) or ceil(upper) > floor(lower):
                    continue
                if upper > 0.0:
                    top = ceil(upper)
                if lower < bottom:
                    bottom = floor(lower)
            elif p[2] < near and q[2] < near and r[2] < near:
                continue
            e0, e1, e2 = _cross(q, r), _cross(r, p), _cross(p, q)
            volume = p[0] * e0[0] + p[1] * e0[1] + p[2] * e0[2]
            if not volume < 0.0:  # seen from behind, or edge on
                continue
            a, b, c = p[3] / volume, q[3] / volume, r[3] / volume
            slope = a * e0[0] + b * e1[0] + c * e2[0]
            fall = a * e0[1] + b * e1[1] + c * e2[1]
            start = a * e0[2] + b * e1[2] + c * e2[2]
            end = slope, fall, start - 1.0 / near
            for v in range(top, bottom + 1):
                low, high = _narrowed(e0, v, 0.0, float(width))
                low, high = _narrowed(e1, v, low, high)
                low, high = _narrowed(e2, v, low, high)
                if cut:
                    low, high = _narrowed(end, v, low, high)
                if low < high:
                    first = ceil(low)
                    value = slope * first + fall * v + start
                    _fill(nearest[v], seen, v, first, ceil(high), np.float32(value), np.float32(slope), t)


@numba.njit(cache=True, error_model="numpy")
def _extent(a: float, b: float, c: float) -> tuple[float, float]:
    """The least and the greatest; written out, as it is much faster here than Python's min and max."""
    low, high = (a, b) if a < b else (b, a)
    return (c if c < low else low), (c if c > high else high)


@numba.njit(cache=True, error_model="numpy")
def _cross(p: NDArray[np.float64], q: NDArray[np.float64]) -> tuple[float, float, float]:
    return p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]


@numba.njit(cache=True, error_model="numpy")
def _narrowed(edge: tuple[float, float, float], v: int, low: float, high: float) -> tuple[float, float]:
    """What of low <= u < high in row `v` lies where the plane is negative.

    Two triangles with an edge in common find the same u for it: no pixel is left out, and none is drawn twice.
    """
    rest = edge[1] * v + edge[2]
    u = -rest / edge[0]
    if edge[0] < 0.0:
        return (u if u > low else low), high
    if edge[0] > 0.0:
        return low, (u if u < high else high)
    inside = rest < 0.0 or (rest == 0.0 and edge[1] < 0.0)
    return (low, high) if inside else (low, low)


@numba.njit(cache=True, error_model="numpy")
def _fill(
    row: NDArray[np.float32],
    seen: NDArray[np.int32] | None,
    v: int,
    low: int,
    high: int,
    value: np.float32,
    slope: np.float32,
    number: int,
) -> None:
    part = row[low:high]
    if seen is None:
        for i in range(high - low):
            here = value + slope * np.float32(i)
            part[i] = here if here >= part[i] else part[i]
        return
    numbers, mine = seen[v, low:high], np.int32(number)
    for i in range(high - low):
        here = value + slope * np.float32(i)
        numbers[i] = mine if here >= part[i] else numbers[i]
        part[i] = here if here >= part[i] else part[i]
