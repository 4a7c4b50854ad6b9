"""Forward and inverse kinematics: where the links are, and which joint positions bring the tool to a pose."""

from typing import Protocol

import numba as nb
import numpy as np
from eaik.IK_HP import HPRobot
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.robot.chain import Chain
from regrasp.interfaces.robot.robot import Robot
from regrasp.motion.robots.forward import (
    ANY_AXIS,
    KIND,
    SIGN,
    SLIDE,
    joint_kinds,
    joint_table,
    link_frames_in,
    tool_frame,
    tool_jacobian,
)
from regrasp.motion.robots.ik_parameters import InverseKinematicsParameters
from regrasp.motion.robots.numerical_ik import NumericalSolver
from regrasp.motion.robots.poses import inverse, multiply, rotation_vector

_ROUNDING = 1e-9  # rad past a joint's limit that are rounding errors
_REFINEMENTS = 8  # steps of Gauss and Newton that improve an answer of the solver; three are common
_NEAR = 0.003  # m and rad that a least-squares answer may be off to be improved; others belong to no branch
_STRAIGHT = 1e-3  # sine of the joint before the last at which a wrist is straight
_NO_WRIST = -1


class Solver(Protocol):
    """What answers for the pose of the tip, in the frame of the first joint's parent."""

    def solve(self, base_from_tip: FloatArray, near: FloatArray | None = None) -> FloatArray:
        """Positions (k, n), some of which may miss the pose (4, 4)."""
        ...


class _ClosedForm:
    """eaik's closed form, for chains of six revolute joints that it can decompose."""

    def __init__(self, chain: Chain, first: int) -> None:
        self._robot = HPRobot(chain.axes[first:], np.vstack([chain.origins[first:], chain.last_from_tool[:3, 3]]))
        self.known = bool(self._robot.hasKnownDecomposition())

    def solve(self, base_from_tip: FloatArray, near: FloatArray | None = None) -> FloatArray:
        return np.array(self._robot.IK(base_from_tip).Q, float).reshape(-1, 6)


class ArmKinematics:
    """One robot whose base frame stands at `base` (world_from_base).

    `lower`, `upper` (n,) are the joints' limits. Arms of six revolute joints that have a closed form are solved by it,
    with all branches; others by iteration, with some of their solutions. A rail is moved only where the arm alone does
    not reach. The *tip* is the frame at the tool's place that is parallel to the last link's.

    Raises ValueError for joints whose lower limit is not below the upper.
    """

    def __init__(
        self,
        robot: Robot,
        base: RigidTransform,
        parameters: InverseKinematicsParameters = InverseKinematicsParameters(),
    ) -> None:
        chain = robot.chain
        self.robot, self.chain, self._parameters = robot, chain, parameters
        self.base: FloatArray = np.ascontiguousarray(base.as_matrix())
        self.joints: FloatArray = joint_table(chain)
        self.last_from_tool = np.ascontiguousarray(chain.last_from_tool)
        self.lower, self.upper = chain.lower, chain.upper
        _check_limits(chain)
        self.tip = np.ascontiguousarray(self.last_from_tool[:3, 3])  # in the last link's frame
        self._rail = robot.rail is not None
        turn = self.last_from_tool[:3, :3]
        self._tool_turn: FloatArray | None = None  # tool_from_tip, where they are not parallel
        if not np.array_equal(turn, np.eye(3)):
            self._tool_turn = np.eye(4)
            self._tool_turn[:3, :3] = turn.T
        self._base_inverse = np.linalg.inv(self.base)
        self._turning = np.ascontiguousarray(~chain.slides)
        self._bounds, self._zero = np.array([chain.lower, chain.upper]), np.zeros(len(chain))
        tolerances = np.array([parameters.position, parameters.angle, parameters.distinct])
        wrist = _straight_wrist_axis(self.joints)
        self._arm = (self.base, self.joints, self.tip, wrist, self._turning, tolerances)
        self._search = NumericalSolver(chain.without(int(self._rail)))
        closed = _closed_form(chain, int(self._rail))
        self._solver: Solver = self._search if closed is None else closed
        self.closed_form = closed is not None

    def __len__(self) -> int:
        """How many joints are driven."""
        return len(self.chain)

    @property
    def reach(self) -> float:
        """How far (m) the tool can be from the base at most: all links in a line, a rail at its end."""
        links = np.linalg.norm(self.chain.origins, axis=1).sum() + np.linalg.norm(self.tip)
        slides = np.maximum(np.abs(self.lower), np.abs(self.upper))[self.chain.slides].sum()
        return float(links + slides)

    def link_frames(self, q: FloatArray) -> FloatArray:
        """World frames (n + 1, 4, 4) of the base and the links, see `Chain`, for joints (n,)."""
        return np.asarray(link_frames_in(self.base, self.joints, np.asarray(q, float)))

    def tool(self, q: FloatArray) -> RigidTransform:
        """world_from_tool: x forward along the gripper, y the direction in which the fingers close."""
        return RigidTransform.from_matrix(self.tool_matrix(q))

    def tool_matrix(self, q: FloatArray) -> FloatArray:
        """`tool` as a matrix (4, 4)."""
        return np.asarray(tool_frame(self.base, self.joints, self.last_from_tool, np.asarray(q, float)))

    def mount(self, q: FloatArray) -> RigidTransform:
        """world_from_mount: where a camera is fixed. Raises RobotError if the robot has no mount."""
        index, link_from_mount = self.robot.mounted
        return RigidTransform.from_matrix(multiply(self.link_frames(q)[index], link_from_mount))

    def jacobian(self, q: FloatArray) -> FloatArray:
        """Derivative (6, n) of the tool's position (m) and rotation (rad), in the world, by the joints."""
        return np.asarray(tool_jacobian(self.base, self.joints, self.last_from_tool, np.asarray(q, float)))

    def ik(self, world_from_tool: RigidTransform | FloatArray, near: FloatArray | None = None) -> FloatArray:
        """Joint positions (k, n) within the limits that bring the tool to a pose; (0, n) when there are none.

        The pose may be a matrix (4, 4). Every row is checked by forward kinematics (0.1 mm, 1 mrad). A joint that may
        turn more than once round stands as near to `near` (n,) as its limits let it, without `near` to zero. With
        `near` a rail stays where it is if the arm reaches from there; else, and without `near`, it may stand at any
        of some places.
        """
        target = world_from_tool if isinstance(world_from_tool, np.ndarray) else world_from_tool.as_matrix()
        return self.ik_tip(target if self._tool_turn is None else multiply(target, self._tool_turn), near)

    def ik_tip(self, world_from_tip: FloatArray, near: FloatArray | None = None) -> FloatArray:
        """As `ik`, for the pose (4, 4) of the tip."""
        if not self._rail:
            return self._searched(world_from_tip, near, 0.0)
        if near is not None and len(here := self._searched(world_from_tip, near, near[0])):
            return here
        found = np.empty((0, len(self)))
        for count in self._parameters.rail_places:
            places = np.linspace(self.lower[0], self.upper[0], count)
            if near is not None:
                places = places[np.argsort(np.abs(places - near[0]), kind="stable")]
            found = np.concatenate([self._answers(world_from_tip, near, place) for place in places])
            if len(found):
                break
        return found

    def solve(self, world_from_tip: FloatArray) -> FloatArray:
        """All solutions (k, n) for the tip's pose (4, 4), wrapped, whatever the limits; with a rail at zero."""
        return np.asarray(_solutions(*self._arm, self._raw(self._solver, world_from_tip, None, 0.0), world_from_tip))

    def _answers(self, world_from_tip: FloatArray, near: FloatArray | None, rail: float) -> FloatArray:
        """As `ik_tip`, with the rail at that m."""
        return self._right(self._raw(self._solver, world_from_tip, near, rail), world_from_tip, near)

    def _searched(self, world_from_tip: FloatArray, near: FloatArray | None, rail: float) -> FloatArray:
        """As `_answers`; a pose with a straight wrist for which the closed form has none is searched.

        There it takes one of many solutions, which may be out of reach.
        """
        raw = self._raw(self._solver, world_from_tip, near, rail)
        found = self._right(raw, world_from_tip, near)
        if len(found) or not self.closed_form or not _any_straight(raw):
            return found
        return self._right(self._raw(self._search, world_from_tip, near, rail), world_from_tip, near)

    def _right(self, raw: FloatArray, world_from_tip: FloatArray, near: FloatArray | None) -> FloatArray:
        """Those of the rows (k, n) that bring the tip to its pose, within the limits and nearest to `near` (n,)."""
        around = self._zero if near is None else near
        return np.asarray(_answers(*self._arm, raw, world_from_tip, self._bounds, around))

    def _raw(self, solver: Solver, world_from_tip: FloatArray, near: FloatArray | None, rail: float) -> FloatArray:
        """A solver's answers (k, n), some of which miss the pose."""
        start = None if near is None else near[int(self._rail) :]
        found = solver.solve(self._in_base(world_from_tip, rail), start)
        return np.column_stack([np.full(len(found), rail), found]) if self._rail else found

    def _in_base(self, world_from_tip: FloatArray, rail: float) -> FloatArray:
        """The tip's pose (4, 4) in the frame of the first joint's parent, of a rail's carriage."""
        target = multiply(self._base_inverse, world_from_tip)
        if self._rail:
            target[:3, 3] -= self.chain.origins[0] + rail * self.chain.axes[0]
        return np.asarray(target)

    def within_limits(self, rows: FloatArray, near: FloatArray | None = None) -> FloatArray:
        """The rows (k, n) within the joint limits, rounding errors aside; whole turns nearest to `near` (n,)."""
        return np.asarray(_within_limits(rows, self._bounds, self._turning, self._zero if near is None else near))


def _check_limits(chain: Chain) -> None:
    for name, lower, upper in zip(chain.names, chain.lower, chain.upper, strict=True):
        if not lower < upper:
            raise ValueError(f"limits of {name} contradict: lower {lower:g} is not below upper {upper:g}")


def past_limits(kin: ArmKinematics, q: FloatArray) -> str:
    """Which of the joints (n,) lie past their limits, and where they and the limits are; '' when none does."""
    past = (q < kin.lower) | (q > kin.upper)
    return ", ".join(
        f"{kin.chain.names[i]} {q[i]:.4g}, limits {kin.lower[i]:.4g} to {kin.upper[i]:.4g}"
        for i in np.flatnonzero(past)
    )


def _closed_form(chain: Chain, first: int) -> _ClosedForm | None:
    """What solves the joints from number `first` on by a closed form; None if there is none."""
    if len(chain) - first != 6 or chain.slides[first:].any():
        return None
    closed = _ClosedForm(chain, first)
    return closed if closed.known else None


def _straight_wrist_axis(joints: FloatArray) -> int:
    """The axis (0 to 2) about which the fourth and the sixth joint turn when the fifth is 0 and the wrist straight.

    -1 where they do not turn about one line then, or not about one of the coordinate axes.
    """
    kinds = joint_kinds(joints)[-3:]
    if len(joints) < 6 or kinds[0] != kinds[2] or kinds[0] >= ANY_AXIS:
        return _NO_WRIST
    across = np.delete(joints[-2:, :3], kinds[0], axis=1)
    return int(kinds[0]) if not across.any() else _NO_WRIST


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def wrap(q: FloatArray) -> FloatArray:
    """Angles brought into [-pi, pi)."""
    return (q + np.pi) % (2 * np.pi) - np.pi


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _reaches(base, joints, tip, q, target, max_distance, max_angle):  # type: ignore[no-untyped-def]
    """Whether joints (n,) bring the tip (3,) m to a target (4, 4) within the tolerances, m and rad."""
    frame = link_frames_in(base, joints, q)[len(q)]
    position, rotation = 0.0, 0.0
    for r in range(3):
        place = frame[r, 3] + (frame[r, 0] * tip[0] + frame[r, 1] * tip[1] + frame[r, 2] * tip[2])
        position += (place - target[r, 3]) ** 2
        for c in range(3):
            rotation += (frame[r, c] - target[r, c]) ** 2
    # |A - B| (Frobenius) = sqrt(8) sin(angle / 2): exact near zero, unlike the arc cosine of the trace
    return position < max_distance**2 and rotation < 8 * np.sin(max_angle / 2) ** 2


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
        q = q + np.linalg.lstsq(jacobian, error, 1e-9)[0]
    return q


def _any_straight(raw: FloatArray) -> bool:
    """Whether the joint before the last is straight in any of the rows (k, n)."""
    return bool(np.any(np.abs(np.sin(raw[:, -2])) < _STRAIGHT))


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _wrapped(rows, turning):  # type: ignore[no-untyped-def]
    """Rows (k, n) with the joints that turn brought into [-pi, pi)."""
    out = rows.copy()
    for joint in range(rows.shape[1]):
        if turning[joint]:
            out[:, joint] = wrap(rows[:, joint])
    return out


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
def _solutions(base, joints, tip, wrist, turning, tolerances, raw, target):  # type: ignore[no-untyped-def]
    """Those of the rows `raw` (k, n) that bring the tip to its pose (4, 4), wrapped, without repetitions."""
    max_distance, max_angle, distinct = tolerances
    out, count, wrapped = np.empty_like(raw), 0, _wrapped(raw, turning)
    for row in range(raw.shape[0]):
        q = wrapped[row]
        if not _reaches(base, joints, tip, q, target, max_distance, max_angle):
            if wrist == _NO_WRIST and not _reaches(base, joints, tip, q, target, _NEAR, _NEAR):
                continue
            if wrist == _NO_WRIST:
                q = _refined(base, joints, tip, q, target)
            else:
                q = _with_straight_wrist(base, joints, wrist, q, target)
            q = _wrapped(q.reshape((1, -1)), turning)[0]
            if not _reaches(base, joints, tip, q, target, max_distance, max_angle):
                continue
        if is_new(q, out, count, distinct):
            out[count] = q
            count += 1
    return out[:count]


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _answers(base, joints, tip, wrist, turning, tolerances, raw, target, bounds, near):  # type: ignore[no-untyped-def]
    """`_solutions` within the limits `bounds` (2, n), nearest to `near` (n,)."""
    return _within_limits(_solutions(base, joints, tip, wrist, turning, tolerances, raw, target), bounds, turning, near)


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _within_limits(rows, bounds, turning, near):  # type: ignore[no-untyped-def]
    """See `ArmKinematics.within_limits`."""
    lower, upper = bounds[0], bounds[1]
    out, count = np.empty_like(rows), 0
    for row in range(rows.shape[0]):
        q = rows[row].copy()
        for joint in range(len(q)):
            if turning[joint] and upper[joint] - lower[joint] > 2 * np.pi + _ROUNDING:
                q[joint] += 2 * np.pi * np.round((near[joint] - q[joint]) / (2 * np.pi))
                if q[joint] > upper[joint]:
                    q[joint] -= 2 * np.pi
                elif q[joint] < lower[joint]:
                    q[joint] += 2 * np.pi
            elif turning[joint] and q[joint] < lower[joint] - _ROUNDING and q[joint] + 2 * np.pi <= upper[joint]:
                q[joint] += 2 * np.pi
            elif turning[joint] and q[joint] > upper[joint] + _ROUNDING and q[joint] - 2 * np.pi >= lower[joint]:
                q[joint] -= 2 * np.pi
        inside = np.minimum(np.maximum(q, lower), upper)
        if np.all(np.abs(inside - q) < _ROUNDING):
            out[count] = inside
            count += 1
    return out[:count]
