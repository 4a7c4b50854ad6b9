"""Joints that follow a tool's way, through singularities of the wrist as well (closed-loop inverse kinematics)."""

from dataclasses import dataclass

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cause import CauseCode
from regrasp.motion.failure import PlanningError
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.robots.poses import rotation_vector


@dataclass(frozen=True)
class FollowingParameters:
    """How the joints follow, and how far the tool may be off its way meanwhile."""

    lever: float = 0.15  # m by which a turn of 1 rad counts: the hand's length
    singular: float = 0.05  # m/rad, least singular value below which steps are damped; the wrist has 0.13 elsewhere
    damping: float = 0.03  # m/rad at a singularity: a hand of 0.2 m/s turns no joint by more than 3.3 rad/s
    passes: int = 2  # Newton steps for a sample; choice
    most_step: float = 0.5  # rad of a joint between two samples
    most_off: float = 0.03  # m, and a turn times the lever, that the tool may be off; choice


def followed(
    kin: ArmKinematics, q: FloatArray, poses: FloatArray, parameters: FollowingParameters = FollowingParameters()
) -> FloatArray:
    r"""Joints (k, n) that bring the tool along poses (k, 4, 4), world_from_tool, from joints (n,) on. A rail stands.

    The first row is `q` itself. Each step towards the next pose, whose error is e, is

    .. math:: \Delta q = J^T (J J^T + \lambda^2 I)^{-1} e, \quad
        \lambda^2 = \lambda_0^2 (1 - (\sigma / \sigma_0)^2) \text{ where } \sigma < \sigma_0

    with the least singular value s of the Jacobian (Nakamura, Hanafusa 1986, "Inverse Kinematic Solutions with
    Singularity Robustness"): at a singularity the tool goes straight on and turns a little instead of the wrist turning
    fast.

    Raises:
        PlanningError: OUT_OF_REACH where the tool is too far off its way, or a joint is at its limit.
    """
    first = int(kin.robot.rail is not None)
    scale = np.repeat([1.0, parameters.lever], 3)
    out = np.empty((len(poses), len(q)))
    out[0] = q
    for i in range(1, len(poses)):
        q = out[i - 1].copy()
        for _ in range(parameters.passes):
            jacobian = kin.jacobian(q)[:, first:] * scale[:, None]
            u, s, vt = np.linalg.svd(jacobian)
            share = min(s[-1] / parameters.singular, 1.0)
            damping = parameters.damping**2 * (1.0 - share * share)
            step = vt.T @ (s / (s * s + damping) * (u.T @ (_error(kin, q, poses[i]) * scale)))
            q[first:] += np.clip(step, -parameters.most_step, parameters.most_step)
        q = np.clip(q, kin.lower, kin.upper)
        out[i] = q
        off = float(np.linalg.norm(_error(kin, q, poses[i]) * scale))
        if off > parameters.most_off:
            at = poses[i][:3, 3].round(3).tolist()
            why = f"the arm cannot go straight on to {at}: its tool would be {1e3 * off:.0f} mm off"
            raise PlanningError(CauseCode.OUT_OF_REACH, why)
    return out


def _error(kin: ArmKinematics, q: FloatArray, pose: FloatArray) -> FloatArray:
    """From the tool at joints (n,) to a pose (4, 4): m and rad (6,) in the world's axes."""
    tool = kin.tool_matrix(q)
    return np.concatenate([pose[:3, 3] - tool[:3, 3], rotation_vector(pose[:3, :3] @ tool[:3, :3].T)])
