"""Straight lines of the tool."""

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation, Slerp

from regrasp.interfaces.cause import CauseCode
from regrasp.motion.failure import PlanningError
from regrasp.motion.robots.kinematics import ArmKinematics, FloatArray

_TURN_STEP = 0.05  # rad of tool rotation between two waypoints
_JUMP = 0.3  # rad of one joint between two waypoints: more is another branch, not the same motion


def straight_line(kin: ArmKinematics, q0: FloatArray, goal: RigidTransform, step: float = 0.005) -> FloatArray:
    """Joint path (k, 6) rad from `q0` (6,) that moves the tool in a straight line to `goal` (world_from_tool).

    Waypoints lie at most `step` metres apart; the rotation turns evenly. Raises PlanningError OUT_OF_REACH where no
    joint angles near those before reach on.
    """
    q0 = np.asarray(q0, float)
    start = kin.tool(q0)
    way = goal.translation - start.translation
    length = float(np.linalg.norm(way))
    turn = float((start.rotation.inv() * goal.rotation).magnitude())
    count = max(1, int(np.ceil(max(length / step, turn / _TURN_STEP) - 1e-9)))
    rotations = Slerp([0.0, 1.0], Rotation.concatenate([start.rotation, goal.rotation]))
    path = [q0]
    for s in np.linspace(0.0, 1.0, count + 1)[1:]:
        pose = RigidTransform.from_components(start.translation + s * way, rotations(s))
        branches = kin.ik(pose)
        change = np.abs(branches - path[-1]).max(axis=1, initial=0.0)
        if not len(branches) or change.min() > _JUMP:
            why = "out of reach" if not len(branches) else f"a joint would jump by {change.min():.2f} rad"
            at = np.array2string(pose.translation, precision=3)
            message = f"straight line of {length:.3f} m stops after {s * length:.3f} m at {at}: {why}"
            raise PlanningError(CauseCode.OUT_OF_REACH, message)
        path.append(branches[change.argmin()])
    return np.array(path)
