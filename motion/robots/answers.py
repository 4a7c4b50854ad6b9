"""What is right among the joint positions that a solver of inverse kinematics gives, compiled."""

import numba as nb
import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.motion.robots.forward import (
    ANY_AXIS,
    KIND,
    LOWER,
    SIGN,
    SLIDE,
    UPPER,
    joint_kinds,
    link_frames_in,
    place_links,
    tool_frame,
    tool_jacobian,
)
from regrasp.motion.robots.poses import inverse, multiply, rotation_vector

_TURN = 2 * np.pi
_ROUNDING = 1e-9  # rad past a joint's limit that are rounding errors
_REFINEMENTS = 8  # steps of Gauss and Newton that improve an answer of the solver; three are common
_NEAR = 0.003  # m and rad that a least-squares answer may be off to be improved; others belong to no branch
_NO_WRIST = -1


def straight_wrist_axis(joints: FloatArray) -> int:
    """The axis (0 to 2) about which the fourth and the sixth joint turn when the fifth is 0 and the wrist straight.

    -1 where they do not turn about one line then, or not about one of the coordinate axes.
    """
    kinds = joint_kinds(joints)[-3:]
    if len(joints) < 6 or kinds[0] != kinds[2] or kinds[0] >= ANY_AXIS:
        return _NO_WRIST
    across = np.delete(joints[-2:, :3], kinds[0], axis=1)
    return int(kinds[0]) if not across.any() else _NO_WRIST


@nb.vectorize([nb.float64(nb.float64)], cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def wrap(angle: float) -> float:
    """Angles brought into [-pi, pi)."""
    turned = angle + np.pi
    if not 0.0 <= turned < _TURN:
        turned %= _TURN
    return turned - np.pi


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def is_new(row: FloatArray, rows: FloatArray, count: int, distinct: float) -> bool:
    """Whether no row of the first `count` differs from this one by `distinct` rad at most in each joint."""
    for other in range(count):
        joint = 0
        while joint < len(row) and abs(wrap(row[joint] - rows[other, joint])) <= distinct:
            joint += 1
        if joint == len(row):
            return False
    return True


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def answers(base, joints, last_from_tool, wrist, tolerances, raw, rail, target, near):  # type: ignore[no-untyped-def]
    """`solutions` within the limits, nearest to `near` (n,)."""
    rows = solutions(base, joints, last_from_tool, wrist, tolerances, raw, rail, target)
    return rows[: keep_within(joints, rows, near)]


@nb.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator,unused-ignore]
def answers_of_all(base, joints, last_from_tool, wrist, tolerances, raw, ends, targets, near):  # type: ignore[no-untyped-def]
    """`answers` for the poses `targets` (m, 4, 4), one after the other, and how many each has (m,).

    The solver's rows for a pose end before `ends` (m,) of the rows `raw` (k, n), where those for the next one begin.
    """
    n = len(joints)
    rows, counts, frames = np.empty((len(raw), n)), np.empty(len(targets), np.int64), np.empty((n + 1, 4, 4))
    frames[0] = base
    begin, kept = 0, 0
    for pose in range(len(targets)):
        mine = rows[kept:]
        found = _right(
            mine, frames, joints, last_from_tool, wrist, tolerances, raw[begin : ends[pose]], 0.0, targets[pose]
        )
        counts[pose] = keep_within(joints, mine[:found], near)
        begin, kept = ends[pose], kept + counts[pose]
    return rows[:kept], counts


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def solutions(base, joints, last_from_tool, wrist, tolerances, raw, rail, target):  # type: ignore[no-untyped-def]
    """Those of the rows `raw` that bring the tool to its pose `target` (4, 4), wrapped, without repetitions.

    The rows (k, n) may lack the first column: that of a rail, which stands at that m.
    """
    rows, frames = np.empty((len(raw), len(joints))), np.empty((len(joints) + 1, 4, 4))
    frames[0] = base
    return rows[: _right(rows, frames, joints, last_from_tool, wrist, tolerances, raw, rail, target)]


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _right(rows, frames, joints, last_from_tool, wrist, tolerances, raw, rail, target):  # type: ignore[no-untyped-def]
    """Write `solutions` into `rows` (k, n), return how many; in `frames` (n + 1, 4, 4) the base is set."""
    within, near_by, distinct = _squares(tolerances[0], tolerances[1]), _squares(_NEAR, _NEAR), tolerances[2]
    n, tip, target, count = len(joints), last_from_tool[:3, 3], _tip_pose(target, last_from_tool), 0
    for row in range(len(raw)):
        q = rows[count]
        _fill(q, raw, row, rail)
        _wrap_turning(q, joints)
        place_links(frames, joints, q)
        if not _meets(frames[n], tip, target, within):
            if wrist == _NO_WRIST and not _meets(frames[n], tip, target, near_by):
                continue
            if wrist == _NO_WRIST:
                q[:] = _refined(frames[0], joints, tip, q, target)
            else:
                q[:] = _with_straight_wrist(frames[0], joints, wrist, q, target)
            _wrap_turning(q, joints)
            place_links(frames, joints, q)
            if not _meets(frames[n], tip, target, within):
                continue
        if is_new(q, rows, count, distinct):
            count += 1
    return count


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _tip_pose(world_from_tool: FloatArray, last_from_tool: FloatArray) -> FloatArray:
    """world_from_tip (4, 4): the *tip* is the frame at the tool's place that is parallel to the last link's."""
    turn = np.eye(4)
    turn[:3, :3] = last_from_tool[:3, :3].T
    return multiply(world_from_tool, turn)


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _fill(q, raw, row, rail):  # type: ignore[no-untyped-def]
    first = len(q) - raw.shape[1]
    if first:
        q[0] = rail
    for joint in range(raw.shape[1]):
        q[first + joint] = raw[row, joint]


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _wrap_turning(q, joints):  # type: ignore[no-untyped-def]
    """Bring the joints that turn into [-pi, pi)."""
    for joint in range(len(q)):
        if joints[joint, KIND] != SLIDE:
            q[joint] = wrap(q[joint])


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _squares(distance: float, angle: float) -> tuple[float, float]:
    """The squares of the distance between two places (m) and of that between two rotations an angle (rad) apart.

    |A - B| (Frobenius) = sqrt(8) sin(angle / 2): exact near zero, unlike the arc cosine of the trace.
    """
    return distance**2, 8 * np.sin(angle / 2) ** 2


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _meets(frame, tip, target, squares):  # type: ignore[no-untyped-def]
    """Whether the tip (3,) m of the last link is at a target (4, 4), as near as `_squares` says."""
    position, rotation = 0.0, 0.0
    for r in range(3):
        place = frame[r, 3] + (frame[r, 0] * tip[0] + frame[r, 1] * tip[1] + frame[r, 2] * tip[2])
        position += (place - target[r, 3]) ** 2
        for c in range(3):
            rotation += (frame[r, c] - target[r, c]) ** 2
    return position < squares[0] and rotation < squares[1]


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _with_straight_wrist(base, joints, axis, raw, target):  # type: ignore[no-untyped-def]
    """The solution `raw` (n,) with a straight wrist, where the solver only gives a least-squares orientation."""
    arm = raw.copy()
    arm[-3:] = 0.0
    forearm = link_frames_in(base, joints, arm)[len(arm) - 3]
    u, v = (axis + 1) % 3, (axis + 2) % 3
    sine, cosine = 0.0, 0.0
    for r in range(3):
        sine += forearm[r, v] * target[r, u] - forearm[r, u] * target[r, v]
        cosine += forearm[r, u] * target[r, u] + forearm[r, v] * target[r, v]
    arm[-1] = joints[-1, SIGN] * np.arctan2(sine, cosine)
    return arm


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _refined(base, joints, tip, q, target):  # type: ignore[no-untyped-def]
    """The solution `q` (n,) brought nearer to the tip's target (4, 4) by Gauss and Newton's method. A rail stays."""
    last = np.eye(4)
    last[:3, 3] = tip
    for _ in range(_REFINEMENTS):
        pose = tool_frame(base, joints, last, q)
        error = np.empty(6)
        error[:3] = target[:3, 3] - pose[:3, 3]
        error[3:] = rotation_vector(multiply(target, inverse(pose))[:3, :3])
        if np.max(np.abs(error)) < 1e-10:
            break
        jacobian = tool_jacobian(base, joints, last, q)
        if joints[0, KIND] == SLIDE:
            jacobian[:, 0] = 0.0
        step = np.linalg.lstsq(jacobian, error, 1e-9)[0]
        if joints[0, KIND] == SLIDE:
            step[0] = 0.0  # the solver's rounding
        q = q + step
    return q


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def keep_within(joints: FloatArray, rows: FloatArray, near: FloatArray) -> int:
    """Move the rows (k, n) within the limits to the front, and return how many these are; they are changed in place.

    See `ArmKinematics.within_limits`.
    """
    count = 0
    for row in range(len(rows)):
        inside = True
        for joint in range(len(joints)):
            value = _whole_turns(joints, joint, rows[row, joint], near[joint])
            kept = min(max(value, joints[joint, LOWER]), joints[joint, UPPER])
            inside = inside and abs(kept - value) < _ROUNDING
            rows[count, joint] = kept
        count += inside
    return count


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _whole_turns(joints, joint, value, near):  # type: ignore[no-untyped-def]
    """A joint's position with whole turns added: nearest to `near`, or just enough to be within its limits."""
    if joints[joint, KIND] == SLIDE:
        return value
    lower, upper = joints[joint, LOWER], joints[joint, UPPER]
    if upper - lower > _TURN + _ROUNDING:
        value += _TURN * np.round((near - value) / _TURN)
        if value > upper:
            return value - _TURN
        return value + _TURN if value < lower else value
    if value < lower - _ROUNDING and value + _TURN <= upper:
        return value + _TURN
    if value > upper + _ROUNDING and value - _TURN >= lower:
        return value - _TURN
    return value
