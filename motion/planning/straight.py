"""Straight lines of the tool (Cartesian paths)."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cause import CauseCode
from regrasp.motion.failure import PlanningError
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.robots.poses import multiply, poses_between

LONGEST_LINE = 20.0  # m; no arm on a rail reaches so far, and a line is cut into steps of millimetres


def straight_line(
    kin: ArmKinematics,
    q0: FloatArray,
    goal: RigidTransform | FloatArray,
    step: float = 0.005,
    turn_step: float = 0.05,
    max_joint_step: float = 0.3,
) -> FloatArray:
    """Joint path (k, n) from `q0` (n,) that moves the tool in a straight line to `goal` (world_from_tool).

    The goal may be a matrix (4, 4). Waypoints lie at most `step` metres and `turn_step` rad of rotation apart; the
    rotation turns evenly (slerp). More than `max_joint_step` rad of one joint between two waypoints would be a change
    to another branch of the inverse kinematics. Raises PlanningError OUT_OF_REACH where no solution continues the path,
    or where the line leads further than `LONGEST_LINE`.
    """
    target = goal if isinstance(goal, np.ndarray) else goal.as_matrix()
    length = float(np.linalg.norm(target[:3, 3] - kin.tool_matrix(q0)[:3, 3]))
    if length > LONGEST_LINE:
        raise PlanningError(CauseCode.OUT_OF_REACH, f"a straight line of {length:.3g} m is out of any arm's reach")
    found = _follow_line(kin, q0, target, step, turn_step, max_joint_step)
    if isinstance(found, _Stop):
        raise PlanningError(CauseCode.OUT_OF_REACH, str(found))
    return found


def straight_lines(
    kin: ArmKinematics, q: FloatArray, poses: Iterable[FloatArray], step: float = 0.005
) -> FloatArray | None:
    """Joint path (k, n) from `q` (n,) in straight lines through poses (4, 4) of the tool; None where it stops."""
    path = [q[None]]
    for pose in poses:
        found = _follow_line(kin, path[-1][-1], pose, step)
        if isinstance(found, _Stop):
            return None
        path.append(found[1:])
    return np.concatenate(path)


def can_continue(kin: ArmKinematics, q: FloatArray, onward: Sequence[RigidTransform], step: float = 0.02) -> bool:
    """Whether the tool at joints (6,) can go on in straight lines to the poses `onward`, given in its own frame."""
    tool = kin.tool_matrix(q)
    return straight_lines(kin, q, [multiply(tool, pose.as_matrix()) for pose in onward], step) is not None


@dataclass(frozen=True)
class _Stop:
    """Where a line of `length` m cannot go on: after a `share` of it, `at` (3,) m; `jump` is in rad, None: no IK."""

    length: float
    share: float
    at: FloatArray
    jump: float | None

    def __str__(self) -> str:
        why = "out of reach" if self.jump is None else f"a joint would jump by {self.jump:.2f} rad"
        at, length = np.array2string(self.at, precision=3), self.length
        return f"straight line of {length:.3f} m stops after {self.share * length:.3f} m at {at}: {why}"


def _follow_line(
    kin: ArmKinematics,
    q0: FloatArray,
    goal: FloatArray,
    step: float,
    turn_step: float = 0.05,
    max_joint_step: float = 0.3,
) -> FloatArray | _Stop:
    """`straight_line` without an exception."""
    start = kin.tool_matrix(q0)
    poses = poses_between(start, goal, step, turn_step)
    path = np.empty((len(poses) + 1, len(q0)))
    path[0] = q0
    for n, pose in enumerate(poses):
        branches = kin.ik(pose, path[n])
        change = np.abs(branches - path[n]).max(axis=1, initial=0.0)
        nearest = change.argmin() if len(change) else None
        if nearest is None or change[nearest] > max_joint_step:
            length = float(np.linalg.norm(goal[:3, 3] - start[:3, 3]))
            jump = None if nearest is None else float(change[nearest])
            return _Stop(length, (n + 1) / len(poses), pose[:3, 3], jump)
        path[n + 1] = branches[nearest]
    return path
