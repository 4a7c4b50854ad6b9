"""Poses as matrices (4, 4), compiled: planning handles too many for a scipy object each."""

import numba as nb
import numpy as np

from regrasp.interfaces.arrays import FloatArray


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def rotation_vector(rotation: FloatArray) -> FloatArray:
    r"""Axis times angle (3,) of a rotation matrix (3, 3), the angle in [0, pi] rad.

    By the quaternion (v, w), which it computes from its largest entry (Shepperd 1978), :math:`\theta = 2 atan(|v|/w)`.
    """
    r = rotation
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    v = np.empty(3)
    i = 0
    if r[1, 1] > r[i, i]:
        i = 1
    if r[2, 2] > r[i, i]:
        i = 2
    if trace > r[i, i]:
        w = 1.0 + trace
        v[0], v[1], v[2] = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    else:
        j, k = (i + 1) % 3, (i + 2) % 3
        w = r[k, j] - r[j, k]
        v[i] = 1.0 - trace + 2 * r[i, i]
        v[j] = r[j, i] + r[i, j]
        v[k] = r[k, i] + r[i, k]
    if w < 0.0:
        v, w = -v, -w
    length = np.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
    if length < 1e-12 * w:
        return 2.0 * v / w
    return v * (2.0 * np.arctan2(length, w) / length)


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def rotation_matrix(vector: FloatArray) -> FloatArray:
    r"""The rotation matrix (3, 3) of axis times angle (3,) rad, by Rodrigues' formula.

    .. math:: R = I + \frac{\sin\theta}{\theta} [v]_\times + \frac{1 - \cos\theta}{\theta^2} [v]_\times^2
    """
    x, y, z = vector
    square = x * x + y * y + z * z
    angle = np.sqrt(square)
    a, b = 1.0, 0.5
    if angle > 1e-8:
        half = np.sin(0.5 * angle) / angle
        a, b = np.sin(angle) / angle, 2.0 * half * half
    out = np.empty((3, 3))
    out[0, 0], out[1, 1], out[2, 2] = 1 - b * (y * y + z * z), 1 - b * (x * x + z * z), 1 - b * (x * x + y * y)
    out[0, 1], out[1, 0] = b * x * y - a * z, b * x * y + a * z
    out[0, 2], out[2, 0] = b * x * z + a * y, b * x * z - a * y
    out[1, 2], out[2, 1] = b * y * z - a * x, b * y * z + a * x
    return out


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def multiply(a: FloatArray, b: FloatArray) -> FloatArray:
    """The product (4, 4) of two poses."""
    out = np.empty((4, 4))
    multiply_into(a, b, out)
    return out


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def multiply_into(a: FloatArray, b: FloatArray, out: FloatArray) -> None:
    """Write the product (4, 4) of two poses."""
    for r in range(3):
        for c in range(4):
            out[r, c] = a[r, 0] * b[0, c] + a[r, 1] * b[1, c] + a[r, 2] * b[2, c]
        out[r, 3] += a[r, 3]
        out[3, r] = 0.0
    out[3, 3] = 1.0


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def inverse(pose: FloatArray) -> FloatArray:
    """The inverse (4, 4) of a pose."""
    out = np.zeros((4, 4))
    for r in range(3):
        for c in range(3):
            out[r, c] = pose[c, r]
            out[r, 3] -= pose[c, r] * pose[c, 3]
    out[3, 3] = 1.0
    return out


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def poses_between(start: FloatArray, goal: FloatArray, step: float, turn_step: float, least: int = 1) -> FloatArray:
    """Poses (n, 4, 4) on the straight line from `start`, which is left out, to `goal`, evenly spaced.

    They lie at most `step` m and `turn_step` rad apart and are at least `least`; the rotation turns evenly about one
    axis (slerp).
    """
    turn = rotation_vector(multiply(inverse(start), goal)[:3, :3])
    way = goal[:3, 3] - start[:3, 3]
    length, angle = np.sqrt(np.sum(way * way)), np.sqrt(np.sum(turn * turn))
    count = max(least, int(np.ceil(max(length / step, angle / turn_step) - 1e-9)))
    out = np.zeros((count, 4, 4))
    for n in range(count):
        share = (n + 1) / count
        turned = rotation_matrix(share * turn)
        for r in range(3):
            for c in range(3):
                out[n, r, c] = start[r, 0] * turned[0, c] + start[r, 1] * turned[1, c] + start[r, 2] * turned[2, c]
            out[n, r, 3] = start[r, 3] + share * way[r]
        out[n, 3, 3] = 1.0
    return out


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def angle_between(a: FloatArray, b: FloatArray) -> float:
    """The angle in rad between the rotations of two poses (4, 4)."""
    turn = rotation_vector(multiply(inverse(a), b)[:3, :3])
    return float(np.sqrt(np.sum(turn * turn)))
