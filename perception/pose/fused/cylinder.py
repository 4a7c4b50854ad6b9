"""Fits a capped cylinder of known size to what a camera saw of it: depth points, and rays along its outline.

Everything is in the camera's optical frame, metres. The body's signed distance is convex, so along a ray it has one
minimum: 0 for a ray that touches the outline, less for one that hits.
"""

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Mask = NDArray[np.bool_]

STEPS = 20  # Levenberg-Marquardt steps at most
CONVERGED = 1e-4  # share of the cost that a step must save to be worth another
COARSE, FINE = 12.0, 2.0  # deviations; choice: what is further off counts less (Cauchy), little while the way is sought
GRAZING = 0.1  # choice: cosine under which a surface that the ray grazes counts as no flatter
SURFACE = 0.0005  # m; choice: what depth readings deviate where the surface runs along the ray
SEARCH_STEPS = 12  # of the golden section: 0.1 m shrinks to 0.3 mm, where the distance is off by micrometres
_GOLD = 0.6180339887498949


@dataclass(frozen=True, eq=False)
class Sight:
    """What was seen of the body.

    `points` (n, 3) m lie on it, `deviations` (n,) m along their rays; `rays` (m, 3) unit vectors along its outline or,
    where `inside` (m,), somewhere in it, `widths` (m,) their deviations in rad. `point_share` and `ray_share`: the
    share of points and rays that count as independent.
    """

    points: FloatArray
    deviations: FloatArray
    rays: FloatArray
    widths: FloatArray
    inside: Mask
    point_share: float
    ray_share: float


@dataclass(frozen=True, eq=False)
class Fit:
    """`center` (3,), unit `axis` (3,), the `cost` (half the sum of squared, faded deviations), `covariance` (5, 5).

    The covariance is that of the centre, then of the turns about `tilts` (2, 3), the unit vectors square to the axis.
    What the sight leaves open is known to the body's length and to 1 rad.
    """

    center: FloatArray
    axis: FloatArray
    cost: float
    covariance: FloatArray
    tilts: FloatArray


def fit(
    sight: Sight, center: FloatArray, axis: FloatArray, radius: float, length: float, fade: float, steps: int = STEPS
) -> Fit:
    """The cylinder of `radius` and `length` m that explains the sight, from a start at `center` (3,) and `axis` (3,).

    What is more than `fade` deviations off counts little.
    """
    center, axis = np.ascontiguousarray(center, float), np.ascontiguousarray(axis, float)
    return Fit(
        *_fit(
            sight.points,
            sight.deviations,
            sight.rays,
            sight.widths,
            sight.inside,
            sight.point_share,
            sight.ray_share,
            center,
            axis,
            radius,
            length / 2,
            fade,
            steps,
        )
    )


def thinned(sight: Sight, count: int) -> Sight:
    """The sight with about `count` points and as many rays, each counting for those left out."""
    p, r = 1 + len(sight.points) // count, 1 + len(sight.rays) // count
    return Sight(
        sight.points[::p],
        sight.deviations[::p],
        sight.rays[::r],
        sight.widths[::r],
        sight.inside[::r],
        sight.point_share * p,
        sight.ray_share * r,
    )


def nearest_on_rays(
    rays: FloatArray, center: FloatArray, axis: FloatArray, radius: float, length: float
) -> tuple[FloatArray, FloatArray]:
    """For unit `rays` (n, 3): the least signed distance (n,) m from the cylinder, and how far out (n,) m that is.

    The distance is below 0 where the ray goes through the body.
    """
    return _nearest_on_rays(np.ascontiguousarray(rays, float), center, axis, radius, length / 2)


@numba.njit(cache=True, error_model="numpy")
def _nearest_on_rays(
    rays: FloatArray, center: FloatArray, axis: FloatArray, radius: float, half: float
) -> tuple[FloatArray, FloatArray]:
    misses, far = np.empty(len(rays)), np.empty(len(rays))
    for i in range(len(rays)):
        misses[i], far[i] = _nearest_on_ray(rays[i], center, axis, radius, half)
    return misses, far


def depth_misses(
    points: FloatArray, deviations: FloatArray, center: FloatArray, axis: FloatArray, radius: float, length: float
) -> FloatArray:
    """How many of their `deviations` (n,) m the `points` (n, 3) lie behind the cylinder on their rays; (n,)."""
    return _depth_misses(points, deviations, center, axis, radius, length / 2)


@numba.njit(cache=True, error_model="numpy")
def _depth_misses(
    points: FloatArray, deviations: FloatArray, center: FloatArray, axis: FloatArray, radius: float, half: float
) -> FloatArray:
    out, gradient = np.empty(len(points)), np.empty(3)
    for i in range(len(points)):
        off, deviation = _point_miss(points[i], deviations[i], center, axis, radius, half, gradient)
        out[i] = off / deviation
    return out


@numba.njit(cache=True, error_model="numpy")
def _point_miss(
    point: FloatArray,
    along_ray: float,
    center: FloatArray,
    axis: FloatArray,
    radius: float,
    half: float,
    gradient: FloatArray,
) -> tuple[float, float]:
    """How far (m) a reading lies behind the body on its ray, and the deviation of that; `gradient` (3,) becomes minus
    its derivative by the body's place. A ray that misses the body has its reading's distance from it instead.
    """
    out = np.sqrt(point[0] ** 2 + point[1] ** 2 + point[2] ** 2)
    x, y, z = point[0] / out, point[1] / out, point[2] / out
    hit, nx, ny, nz = _first_hit(x, y, z, center, axis, radius, half)
    if hit > 0:
        facing = min(nx * x + ny * y + nz * z, -GRAZING)
        gradient[0], gradient[1], gradient[2] = nx / facing, ny / facing, nz / facing
        return out - hit, np.sqrt(along_ray * along_ray + (SURFACE / facing) ** 2)
    off, nx, ny, nz = distance(point[0], point[1], point[2], center, axis, radius, half)
    gradient[0], gradient[1], gradient[2] = nx, ny, nz
    return off, np.sqrt((along_ray * (nx * x + ny * y + nz * z)) ** 2 + SURFACE**2)


@numba.njit(cache=True, error_model="numpy")
def _first_hit(
    x: float, y: float, z: float, center: FloatArray, axis: FloatArray, radius: float, half: float
) -> tuple[float, float, float, float]:
    """How far out (m) a unit ray from the camera meets the body, and the outward normal there; 0 if it misses."""
    slope = x * axis[0] + y * axis[1] + z * axis[2]
    start = center[0] * axis[0] + center[1] * axis[1] + center[2] * axis[2]
    px, py, pz = x - slope * axis[0], y - slope * axis[1], z - slope * axis[2]
    cx, cy, cz = center[0] - start * axis[0], center[1] - start * axis[1], center[2] - start * axis[2]
    a, b = px * px + py * py + pz * pz, px * cx + py * cy + pz * cz
    inside = b * b - a * (cx * cx + cy * cy + cz * cz - radius * radius)
    if inside > 0 and a > 1e-12:
        t = (b - np.sqrt(inside)) / a
        if abs(t * slope - start) <= half:
            return t, (t * px - cx) / radius, (t * py - cy) / radius, (t * pz - cz) / radius
    if abs(slope) > 1e-9:
        side = -1.0 if slope > 0 else 1.0  # the cap that faces the camera
        t = (start + side * half) / slope
        qx, qy, qz = t * px - cx, t * py - cy, t * pz - cz
        if t > 0 and qx * qx + qy * qy + qz * qz <= radius * radius:
            return t, side * axis[0], side * axis[1], side * axis[2]
    return 0.0, 0.0, 0.0, 0.0


@numba.njit(cache=True, error_model="numpy")
def distance(
    x: float, y: float, z: float, center: FloatArray, axis: FloatArray, radius: float, half: float
) -> tuple[float, float, float, float]:
    """Signed distance m of a point from the cylinder's surface, and its gradient (3)."""
    qx, qy, qz = x - center[0], y - center[1], z - center[2]
    along = qx * axis[0] + qy * axis[1] + qz * axis[2]
    px, py, pz = qx - along * axis[0], qy - along * axis[1], qz - along * axis[2]
    across = np.sqrt(px * px + py * py + pz * pz) + 1e-15
    px, py, pz = px / across, py / across, pz / across
    side, cap = across - radius, abs(along) - half
    sign = 1.0 if along >= 0 else -1.0
    if side > 0 and cap > 0:
        out = np.sqrt(side * side + cap * cap)
        a, b = side / out, cap / out * sign
        return out, a * px + b * axis[0], a * py + b * axis[1], a * pz + b * axis[2]
    if side > cap:
        return side, px, py, pz
    return cap, sign * axis[0], sign * axis[1], sign * axis[2]


@numba.njit(cache=True, error_model="numpy")
def _nearest_on_ray(
    ray: FloatArray, center: FloatArray, axis: FloatArray, radius: float, half: float
) -> tuple[float, float]:
    """Least signed distance along a ray from the camera, and how far out (m) it is.

    Where the ray passes nearest to the axis, if that is well between the ends; else by golden section.
    """
    out = ray[0] * center[0] + ray[1] * center[1] + ray[2] * center[2]
    slope = ray[0] * axis[0] + ray[1] * axis[1] + ray[2] * axis[2]
    start = center[0] * axis[0] + center[1] * axis[1] + center[2] * axis[2]
    middle = (out - slope * start) / max(1.0 - slope * slope, 1e-3)
    if slope * slope < 0.999 and abs(middle * slope - start) < half - radius:
        return distance(middle * ray[0], middle * ray[1], middle * ray[2], center, axis, radius, half)[0], middle
    low, high = out - half - radius, out + half + radius
    first, second = high - _GOLD * (high - low), low + _GOLD * (high - low)
    at_first = distance(first * ray[0], first * ray[1], first * ray[2], center, axis, radius, half)[0]
    at_second = distance(second * ray[0], second * ray[1], second * ray[2], center, axis, radius, half)[0]
    for _ in range(SEARCH_STEPS):
        if at_first < at_second:
            high, second, at_second = second, first, at_first
            first = high - _GOLD * (high - low)
            at_first = distance(first * ray[0], first * ray[1], first * ray[2], center, axis, radius, half)[0]
        else:
            low, first, at_first = first, second, at_second
            second = low + _GOLD * (high - low)
            at_second = distance(second * ray[0], second * ray[1], second * ray[2], center, axis, radius, half)[0]
    best = 0.5 * (low + high)
    return min(at_first, at_second), best


@numba.njit(cache=True, error_model="numpy")
def _add(
    hessian: FloatArray,
    gradient: FloatArray,
    row: FloatArray,
    residual: float,
    deviation: float,
    fade: float,
    share: float,
) -> float:
    """Add one residual with its row of derivatives (5,) to the normal equations; its cost."""
    whitened = residual / deviation / fade
    weight = share / (deviation * deviation * (1.0 + whitened * whitened))
    for i in range(5):
        gradient[i] += weight * row[i] * residual
        for j in range(5):
            hessian[i, j] += weight * row[i] * row[j]
    return 0.5 * share * fade * fade * np.log1p(whitened * whitened)


@numba.njit(cache=True, error_model="numpy")
def _row(
    row: FloatArray,
    x: float,
    y: float,
    z: float,
    gx: float,
    gy: float,
    gz: float,
    center: FloatArray,
    tilts: FloatArray,
) -> None:
    """Derivatives (5,) of the distance at a point with gradient g: by the centre, and by turns about the tilts."""
    row[0], row[1], row[2] = -gx, -gy, -gz
    qx, qy, qz = x - center[0], y - center[1], z - center[2]
    cx, cy, cz = qy * gz - qz * gy, qz * gx - qx * gz, qx * gy - qy * gx
    for k in range(2):
        row[3 + k] = -(tilts[k, 0] * cx + tilts[k, 1] * cy + tilts[k, 2] * cz)


@numba.njit(cache=True, error_model="numpy")
def _equations(
    points: FloatArray,
    deviations: FloatArray,
    rays: FloatArray,
    widths: FloatArray,
    inside: Mask,
    point_share: float,
    ray_share: float,
    center: FloatArray,
    axis: FloatArray,
    tilts: FloatArray,
    radius: float,
    half: float,
    fade: float,
) -> tuple[FloatArray, FloatArray, float]:
    """Normal equations (5, 5), (5,) at a pose, and the cost."""
    hessian, gradient, row, normal = np.zeros((5, 5)), np.zeros(5), np.zeros(5), np.zeros(3)
    cost = 0.0
    for i in range(len(points)):
        off, deviation = _point_miss(points[i], deviations[i], center, axis, radius, half, normal)
        _row(row, points[i, 0], points[i, 1], points[i, 2], normal[0], normal[1], normal[2], center, tilts)
        cost += _add(hessian, gradient, row, off, deviation, fade, point_share)
    for i in range(len(rays)):
        out, far = _nearest_on_ray(rays[i], center, axis, radius, half)
        if inside[i] and out <= 0:
            continue
        x, y, z = far * rays[i, 0], far * rays[i, 1], far * rays[i, 2]
        out, gx, gy, gz = distance(x, y, z, center, axis, radius, half)
        # At the rim the gradient jumps between two that are aslant to the ray: only what is square to it is true.
        along = gx * rays[i, 0] + gy * rays[i, 1] + gz * rays[i, 2]
        gx, gy, gz = gx - along * rays[i, 0], gy - along * rays[i, 1], gz - along * rays[i, 2]
        _row(row, x, y, z, gx, gy, gz, center, tilts)
        cost += _add(hessian, gradient, row, out, widths[i] * far, fade, ray_share)
    return hessian, gradient, cost


@numba.njit(cache=True, error_model="numpy")
def _tilts(axis: FloatArray) -> FloatArray:
    """Two unit vectors (2, 3) square to the axis and to each other."""
    out = np.zeros((2, 3))
    k = np.argmin(np.abs(axis))
    out[0, k] = 1.0
    out[0] -= axis[k] * axis
    out[0] /= np.sqrt(np.sum(out[0] ** 2))
    out[1] = np.cross(axis, out[0])
    return out


@numba.njit(cache=True, error_model="numpy")
def _fit(
    points: FloatArray,
    deviations: FloatArray,
    rays: FloatArray,
    widths: FloatArray,
    inside: Mask,
    point_share: float,
    ray_share: float,
    center: FloatArray,
    axis: FloatArray,
    radius: float,
    half: float,
    fade: float,
    steps: int,
) -> tuple[FloatArray, FloatArray, float, FloatArray, FloatArray]:
    """Levenberg-Marquardt from a start."""
    tilts, damping = _tilts(axis), 1e-3
    hessian, gradient, cost = _equations(
        points, deviations, rays, widths, inside, point_share, ray_share, center, axis, tilts, radius, half, fade
    )
    for _ in range(steps):
        damped = hessian.copy()
        for k in range(5):
            damped[k, k] += damping * hessian[k, k] + 1e-9
        step = np.linalg.solve(damped, -gradient)
        turn = step[3] * tilts[0] + step[4] * tilts[1]
        moved = center + step[:3]
        turned = axis + np.cross(turn, axis)
        turned /= np.sqrt(np.sum(turned**2))
        around = _tilts(turned)
        new = _equations(
            points, deviations, rays, widths, inside, point_share, ray_share, moved, turned, around, radius, half, fade
        )
        if new[2] < cost:
            saved = cost - new[2]
            center, axis, tilts = moved, turned, around
            hessian, gradient, cost = new
            damping = max(damping * 0.2, 1e-6)
            if saved < CONVERGED * cost:
                break
        else:
            damping *= 8.0
            if damping > 1e6:
                break
    for k in range(5):
        hessian[k, k] += 0.25 / half**2 if k < 3 else 1.0
    return center, axis, cost, np.linalg.inv(hessian), tilts
