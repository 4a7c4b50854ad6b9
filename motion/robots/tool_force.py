"""The force on what an arm holds, as its drives feel it."""

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.motion.robots.kinematics import ArmKinematics


def tool_force(kin: ArmKinematics, q: FloatArray, efforts: FloatArray, point: FloatArray) -> FloatArray:
    r"""The force (3,) N in the world on the tool at `point` (3,) m, world, that best explains a change of `efforts`.

    `efforts` (n,) N m is by how much the drives of the arm at rest at `q` (n,) now push more than without that force.
    There is no moment about the point, as on a tip. By the principle of virtual work, least squares of

    .. math:: \Delta\tau = -J_p(q)^T f
    """
    return np.asarray(np.linalg.lstsq(-_jacobian_at(kin, q, point)[:3].T, efforts, rcond=None)[0])


def tool_wrench(kin: ArmKinematics, q: FloatArray, efforts: FloatArray, point: FloatArray) -> FloatArray:
    """The force N and the moment N m about `point`, (6,) in the world, on the tool; else as `tool_force`."""
    return np.asarray(np.linalg.lstsq(-_jacobian_at(kin, q, point).T, efforts, rcond=None)[0])


def _jacobian_at(kin: ArmKinematics, q: FloatArray, point: FloatArray) -> FloatArray:
    """The Jacobian (6, n) of a point (3,) m, world, that moves with the tool."""
    jacobian = kin.jacobian(q)
    lever = point - kin.tool_matrix(q)[:3, 3]
    return np.vstack([jacobian[:3] + np.cross(jacobian[3:], lever, axis=0), jacobian[3:]])
