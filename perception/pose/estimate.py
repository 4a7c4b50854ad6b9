"""The covariance of an estimate of the connector's pose, and what holds where a look does not tell."""

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.sight import Estimate as Estimate
from regrasp.interfaces.cable.sight import NoEstimate as NoEstimate

# World frame. Decides the sign of the axis where nothing else does: plugs of the cell point to +y.
DEFAULT_AXIS = np.array([0.0, 1.0, 0.0])
# rad^2, of an angle that is uniform over a full turn: a cylinder's roll about its axis.
ROLL_VARIANCE = np.pi**2 / 3


def pose_covariance(axis: FloatArray, position: float, angle: float) -> FloatArray:
    """Covariance (6, 6) of a pose whose position has the deviation `position` (m) on each axis.

    Its unit `axis` (3,) has the deviation `angle` (rad) about each direction across it; its roll is unknown.
    """
    out = np.zeros((6, 6))
    out[:3, :3] = position**2 * np.eye(3)
    out[3:, 3:] = angle**2 * np.eye(3) + (ROLL_VARIANCE - angle**2) * np.outer(axis, axis)
    return out
