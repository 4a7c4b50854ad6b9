"""Straight lines of the tool (Cartesian paths)."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation, Slerp

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cause import CauseCode
from regrasp.motion.failure import PlanningError
from regrasp.motion.robots.kinematics import ArmKinematics


def straight_line(
    kin: ArmKinematics,
    q0: FloatArray,
    goal: RigidTransform,
    step: float = 0.005,
    turn_step: float = 0.05,
    max_joint_step: float = 0.3,
) -> FloatArray:
    """Joint path (k, 6) rad from `q0` (6,) that moves the tool in a straight line to `goal` (world_from_tool).

    Waypoints lie at most `step` metres and `turn_step` rad of rotation apart; the rotation turns evenly (slerp). More
    than `max_joint_step` rad of one joint between two waypoints would be a change to another branch of the inverse
    kinematics. Raises PlanningError OUT_OF_REACH where no solution continues the path.
    """
    q0 = np.asarray(q0, float)
    start = kin.tool(q0)
    displacement = goal.translation - start.translation
    length = float(np.linalg.norm(displacement))
    turn = float((start.rotation.inv() * goal.rotation).magnitude())
    count = max(1, int(np.ceil(max(length / step, turn / turn_step) - 1e-9)))
    rotations = Slerp([0.0, 1.0], Rotation.concatenate([start.rotation, goal.rotation]))
    path = [q0]
    for s in np.linspace(0.0, 1.0, count + 1)[1:]:
        pose = RigidTransform.from_components(start.translation + s * displacement, rotations(s))
        branches = kin.ik(pose)
        change = np.abs(branches - path[-1]).max(axis=1, initial=0.0)
        if not len(branches) or change.min() > max_joint_step:
            why = "out of reach" if not len(branches) else f"a joint would jump by {change.min():.2f} rad"
            at = np.array2string(pose.translation, precision=3)
            message = f"straight line of {length:.3f} m stops after {s * length:.3f} m at {at}: {why}"
            raise PlanningError(CauseCode.OUT_OF_REACH, message)
        path.append(branches[change.argmin()])
    return np.array(path)


def straight_lines(
    kin: ArmKinematics, q: FloatArray, poses: Sequence[RigidTransform], step: float
) -> FloatArray | None:
    """Joint path (k, 6) rad from `q` (6,) in straight lines through poses world_from_tool; None where it stops."""
    path = q[None]
    try:
        for pose in poses:
            path = np.vstack([path, straight_line(kin, path[-1], pose, step)[1:]])
    except PlanningError:
        return None
    return path
