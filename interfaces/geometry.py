"""Rotations in arrays: for loops in which a scipy object each time would cost too much."""

import numpy as np

from regrasp.interfaces.arrays import FloatArray


def skew(vectors: FloatArray) -> FloatArray:
    """Matrices (..., 3, 3) that times w give v x w for each v of `vectors` (..., 3)."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    out = np.zeros((*vectors.shape, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -z, y, -x
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = z, -y, x
    return out


def axes_along(directions: FloatArray) -> FloatArray:
    """Rotations (n, 3, 3) whose x axes point along `directions` (n, 3), of any length, z as far up as that allows.

    For a direction within 8 degrees of the vertical the world's x axis takes the place of up.
    """
    x = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    up = np.where(np.abs(x[:, 2:]) < 0.99, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])
    y = np.cross(up, x)
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=2)


def rotation_about(axis: FloatArray, angle: float) -> FloatArray:
    r"""The rotation matrix (3, 3) by `angle` rad about a unit axis k (3,), by Rodrigues' formula.

    .. math:: R = I + \sin\theta [k]_\times + (1 - \cos\theta) [k]_\times^2
    """
    k = skew(axis)
    return np.asarray(np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k)
