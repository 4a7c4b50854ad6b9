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


def rotation_about(axis: FloatArray, angle: float) -> FloatArray:
    r"""The rotation matrix (3, 3) by `angle` rad about a unit axis k (3,), by Rodrigues' formula.

    .. math:: R = I + \sin\theta [k]_\times + (1 - \cos\theta) [k]_\times^2
    """
    k = skew(axis)
    return np.asarray(np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k)
