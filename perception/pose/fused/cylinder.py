"""The compiled arithmetic of `cylinder_fit`: a capped cylinder's distances, the normal equations and their solution.

All of it is in one file: numba's cache does not notice a change of a function that another file compiles in.

Everything is in the camera's optical frame, metres; `half` is half the cylinder's length. The body's signed distance is
convex, so along a ray it has one minimum: 0 for a ray that touches the silhouette, less for one that hits the body.
"""

import numba
import numpy as np

from regrasp.interfaces.arrays import FloatArray, Mask

GOLDEN_RATIO = 0.6180339887498949


@numba.njit(cache=True, error_model="numpy")
def closest_approaches(
    rays: FloatArray, center: FloatArray, axis: FloatArray, radius: float, half: float, search_steps: int
) -> tuple[FloatArray, FloatArray]:
    """See `regrasp.perception.pose.fused.cylinder_fit.closest_approaches`."""
    distances, ranges = np.empty(len(rays)), np.empty(len(rays))
    for i in range(len(rays)):
        distances[i], ranges[i] = _closest_approach(rays[i], center, axis, radius, half, search_steps)
    return distances, ranges


@numba.njit(cache=True, error_model="numpy")
def depth_residuals(
    points: FloatArray,
    deviations: FloatArray,
    center: FloatArray,
    axis: FloatArray,
    radius: float,
    half: float,
    min_facing: float,
    surface_noise: float,
) -> FloatArray:
    """See `regrasp.perception.pose.fused.cylinder_fit.depth_residuals`."""
    out, gradient = np.empty(len(points)), np.empty(3)
    for i in range(len(points)):
        residual, deviation = _point_residual(
            points[i], deviations[i], center, axis, radius, half, min_facing, surface_noise, gradient
        )
        out[i] = residual / deviation
    return out


@numba.njit(cache=True, error_model="numpy")
def _point_residual(
    point: FloatArray,
    along_ray: float,
    center: FloatArray,
    axis: FloatArray,
    radius: float,
    half: float,
    min_facing: float,
    surface_noise: float,
    gradient: FloatArray,
) -> tuple[float, float]:
    """How far (m) a reading lies behind the body on its ray, and the deviation of that.

    `gradient` (3,) receives the negative derivative with respect to the body's centre. If the ray misses the body, the
    residual is the reading's distance from the body.
    """
    out = np.sqrt(point[0] ** 2 + point[1] ** 2 + point[2] ** 2)
    x, y, z = point[0] / out, point[1] / out, point[2] / out
    hit, nx, ny, nz = _first_hit(x, y, z, center, axis, radius, half)
    if hit > 0:
        facing = min(nx * x + ny * y + nz * z, -min_facing)
        gradient[0], gradient[1], gradient[2] = nx / facing, ny / facing, nz / facing
        return out - hit, np.sqrt(along_ray * along_ray + (surface_noise / facing) ** 2)
    residual, nx, ny, nz = signed_distance(point[0], point[1], point[2], center, axis, radius, half)
    gradient[0], gradient[1], gradient[2] = nx, ny, nz
    return residual, np.sqrt((along_ray * (nx * x + ny * y + nz * z)) ** 2 + surface_noise**2)


@numba.njit(cache=True, error_model="numpy")
def _first_hit(
    x: float, y: float, z: float, center: FloatArray, axis: FloatArray, radius: float, half: float
) -> tuple[float, float, float, float]:
    """Range (m) at which a unit ray from the camera hits the body, and the outward normal there; 0 if it misses."""
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
def signed_distance(
    x: float, y: float, z: float, center: FloatArray, axis: FloatArray, radius: float, half: float
) -> tuple[float, float, float, float]:
    """Signed distance (m) of a point from the body's surface, below 0 inside, and its gradient (3)."""
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
def _closest_approach(
    ray: FloatArray, center: FloatArray, axis: FloatArray, radius: float, half: float, search_steps: int
) -> tuple[float, float]:
    """Least signed distance (m) along a unit ray from the camera, and the range (m) where it is.

    In closed form where the ray passes nearest to the axis well between the ends, else by golden section search.
    """
    out = ray[0] * center[0] + ray[1] * center[1] + ray[2] * center[2]
    slope = ray[0] * axis[0] + ray[1] * axis[1] + ray[2] * axis[2]
    start = center[0] * axis[0] + center[1] * axis[1] + center[2] * axis[2]
    middle = (out - slope * start) / max(1.0 - slope * slope, 1e-3)
    if slope * slope < 0.999 and abs(middle * slope - start) < half - radius:
        return _distance_on_ray(middle, ray, center, axis, radius, half), middle
    low, high = out - half - radius, out + half + radius
    first, second = high - GOLDEN_RATIO * (high - low), low + GOLDEN_RATIO * (high - low)
    at_first = _distance_on_ray(first, ray, center, axis, radius, half)
    at_second = _distance_on_ray(second, ray, center, axis, radius, half)
    for _ in range(search_steps):
        if at_first < at_second:
            high, second, at_second = second, first, at_first
            first = high - GOLDEN_RATIO * (high - low)
            at_first = _distance_on_ray(first, ray, center, axis, radius, half)
        else:
            low, first, at_first = first, second, at_second
            second = low + GOLDEN_RATIO * (high - low)
            at_second = _distance_on_ray(second, ray, center, axis, radius, half)
    best = 0.5 * (low + high)
    return min(at_first, at_second), best


@numba.njit(cache=True, error_model="numpy")
def _distance_on_ray(
    out: float, ray: FloatArray, center: FloatArray, axis: FloatArray, radius: float, half: float
) -> float:
    """Signed distance (m) of the point at the range `out` (m) on a unit ray."""
    return signed_distance(out * ray[0], out * ray[1], out * ray[2], center, axis, radius, half)[0]


@numba.njit(cache=True, error_model="numpy")
def _add_residual(
    hessian: FloatArray,
    gradient: FloatArray,
    row: FloatArray,
    residual: float,
    deviation: float,
    scale: float,
    share: float,
) -> float:
    """Add one residual with its row (5,) of the Jacobian to the normal equations; its Cauchy cost."""
    whitened = residual / deviation / scale
    weight = share / (deviation * deviation * (1.0 + whitened * whitened))
    for i in range(5):
        gradient[i] += weight * row[i] * residual
        for j in range(5):
            hessian[i, j] += weight * row[i] * row[j]
    return 0.5 * share * scale * scale * np.log1p(whitened * whitened)


@numba.njit(cache=True, error_model="numpy")
def _jacobian_row(
    row: FloatArray,
    x: float,
    y: float,
    z: float,
    gx: float,
    gy: float,
    gz: float,
    center: FloatArray,
    tilt_axes: FloatArray,
) -> None:
    """Derivatives (5,) of the distance at a point with gradient g: by centre, and by rotation about the tilt axes."""
    row[0], row[1], row[2] = -gx, -gy, -gz
    qx, qy, qz = x - center[0], y - center[1], z - center[2]
    cx, cy, cz = qy * gz - qz * gy, qz * gx - qx * gz, qx * gy - qy * gx
    for k in range(2):
        row[3 + k] = -(tilt_axes[k, 0] * cx + tilt_axes[k, 1] * cy + tilt_axes[k, 2] * cz)


@numba.njit(cache=True, error_model="numpy")
def normal_equations(
    points: FloatArray,
    point_deviations: FloatArray,
    rays: FloatArray,
    ray_deviations: FloatArray,
    occluded: Mask,
    point_share: float,
    ray_share: float,
    center: FloatArray,
    axis: FloatArray,
    tilts: FloatArray,
    radius: float,
    half: float,
    scale: float,
    min_facing: float,
    surface_noise: float,
    search_steps: int,
) -> tuple[FloatArray, FloatArray, float]:
    """Hessian (5, 5) and gradient (5,) of the cost at a pose, and the cost; `scale` is the Cauchy loss's."""
    hessian, gradient, row, normal = np.zeros((5, 5)), np.zeros(5), np.zeros(5), np.zeros(3)
    cost = 0.0
    for i in range(len(points)):
        residual, deviation = _point_residual(
            points[i], point_deviations[i], center, axis, radius, half, min_facing, surface_noise, normal
        )
        _jacobian_row(row, points[i, 0], points[i, 1], points[i, 2], normal[0], normal[1], normal[2], center, tilts)
        cost += _add_residual(hessian, gradient, row, residual, deviation, scale, point_share)
    for i in range(len(rays)):
        out, far = _closest_approach(rays[i], center, axis, radius, half, search_steps)
        if occluded[i] and out <= 0:
            continue
        x, y, z = far * rays[i, 0], far * rays[i, 1], far * rays[i, 2]
        out, gx, gy, gz = signed_distance(x, y, z, center, axis, radius, half)
        # At the rim the gradient jumps between two that are oblique to the ray: only the part across it is right.
        along = gx * rays[i, 0] + gy * rays[i, 1] + gz * rays[i, 2]
        gx, gy, gz = gx - along * rays[i, 0], gy - along * rays[i, 1], gz - along * rays[i, 2]
        _jacobian_row(row, x, y, z, gx, gy, gz, center, tilts)
        cost += _add_residual(hessian, gradient, row, out, ray_deviations[i] * far, scale, ray_share)
    return hessian, gradient, cost


@numba.njit(cache=True, error_model="numpy")
def tilt_axes(axis: FloatArray) -> FloatArray:
    """Two unit vectors (2, 3) square to the axis and to each other."""
    out = np.zeros((2, 3))
    k = np.argmin(np.abs(axis))
    out[0, k] = 1.0
    out[0] -= axis[k] * axis
    out[0] /= np.sqrt(np.sum(out[0] ** 2))
    out[1] = np.cross(axis, out[0])
    return out


@numba.njit(cache=True, error_model="numpy")
def levenberg_marquardt(
    points: FloatArray,
    point_deviations: FloatArray,
    rays: FloatArray,
    ray_deviations: FloatArray,
    occluded: Mask,
    point_share: float,
    ray_share: float,
    center: FloatArray,
    axis: FloatArray,
    radius: float,
    half: float,
    scale: float,
    min_facing: float,
    surface_noise: float,
    search_steps: int,
    max_steps: int,
    min_gain: float,
) -> tuple[FloatArray, FloatArray, float, FloatArray, FloatArray]:
    """Centre, axis, cost, covariance (5, 5) and tilt axes of the fit; see `cylinder_fit.fit_cylinder`."""
    tilts, damping = tilt_axes(axis), 1e-3
    seen = (points, point_deviations, rays, ray_deviations, occluded, point_share, ray_share)
    body = (radius, half, scale, min_facing, surface_noise, search_steps)
    hessian, gradient, cost = normal_equations(*seen, center, axis, tilts, *body)
    for _ in range(max_steps):
        damped = hessian.copy()
        for k in range(5):
            damped[k, k] += damping * hessian[k, k] + 1e-9
        step = np.linalg.solve(damped, -gradient)
        rotation = step[3] * tilts[0] + step[4] * tilts[1]
        new_center = center + step[:3]
        new_axis = axis + np.cross(rotation, axis)
        new_axis /= np.sqrt(np.sum(new_axis**2))
        new_tilts = tilt_axes(new_axis)
        new = normal_equations(*seen, new_center, new_axis, new_tilts, *body)
        if new[2] < cost:
            gain = cost - new[2]
            center, axis, tilts = new_center, new_axis, new_tilts
            hessian, gradient, cost = new
            damping = max(damping * 0.2, 1e-6)
            if gain < min_gain * cost:
                break
        else:
            damping *= 8.0
            if damping > 1e6:
                break
    for k in range(5):  # a weak prior, so that what is not observed has a finite variance
        hessian[k, k] += 0.25 / half**2 if k < 3 else 1.0
    return center, axis, cost, np.linalg.inv(hessian), tilts
