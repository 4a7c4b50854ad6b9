"""Forward and inverse kinematics: where the links are, and which joint positions bring the tool to a pose."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Protocol, cast

import numpy as np
from eaik.pybindings.EAIK import Robot as EaikRobot
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.robot.chain import Chain
from regrasp.interfaces.robot.robot import Robot
from regrasp.motion.robots.answers import answers, answers_of_all, keep_within, solutions, straight_wrist_axis
from regrasp.motion.robots.forward import joint_table, link_frames_in, tool_frame, tool_jacobian
from regrasp.motion.robots.ik_parameters import InverseKinematicsParameters
from regrasp.motion.robots.numerical_ik import NumericalSolver
from regrasp.motion.robots.poses import multiply

_THREADS = 2
_WORTH_THREADS, _WORTH_CHECKING = 64, 256  # below so many poses starting threads to solve, to check takes longer
_STRAIGHT = 1e-3  # sine of the joint before the last at which a wrist is straight


class Solver(Protocol):
    """What answers for the pose of the tool in the world, with a rail at zero."""

    def solve(self, world_from_tool: FloatArray, near: FloatArray | None = None) -> FloatArray:
        """Positions (k, n), some of which may miss the pose (4, 4)."""
        ...


class _ClosedForm:
    """eaik's closed form, for chains of six revolute joints that it can decompose."""

    def __init__(self, chain: Chain, base: FloatArray) -> None:
        turn, places = base[:3, :3], np.vstack([chain.origins, chain.last_from_tool[:3, 3]]) @ base[:3, :3].T
        places[0] += base[:3, 3]
        # The package's own wrapper, HPRobot, takes no tool that is turned.
        robot = EaikRobot(turn @ chain.axes.T, places.T, turn @ chain.last_from_tool[:3, :3], [], True)
        self.known, self._robot = bool(robot.has_known_decomposition()), robot

    def solve(self, world_from_tool: FloatArray, near: FloatArray | None = None) -> FloatArray:
        return self._robot.calculate_IK(world_from_tool).Q

    def solve_all(self, world_from_tools: FloatArray) -> list[FloatArray]:
        """The answers (k, n) for each of the poses (m, 4, 4), of which many are shared between threads."""
        if len(world_from_tools) < _WORTH_THREADS:
            return [self.solve(pose) for pose in world_from_tools]
        return [found.Q for found in self._robot.calculate_IK_batched(world_from_tools, _THREADS)]


class ArmKinematics:
    """One robot whose base frame stands at `base` (world_from_base).

    `lower`, `upper` (n,) are the joints' limits. Arms of six revolute joints that have a closed form are solved by it,
    with all branches; others by iteration, with some of their solutions. A rail is moved only where the arm alone does
    not reach.

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
        self._rail = robot.rail is not None
        self._zero = np.zeros(len(chain))
        tolerances = np.array([parameters.position, parameters.angle, parameters.distinct])
        wrist = straight_wrist_axis(self.joints)
        self._arm = (self.base, self.joints, self.last_from_tool, wrist, tolerances)
        turning, parent = chain.without(int(self._rail)), self.base.copy()
        self._along_rail = self.base[:3, :3] @ chain.axes[0]
        if self._rail:
            parent[:3, 3] += self.base[:3, :3] @ chain.origins[0]
        self._search = NumericalSolver(turning, parent)
        closed = _closed_form(turning, parent)
        self._solver: Solver = self._search if closed is None else closed
        self.closed_form = closed is not None

    def __len__(self) -> int:
        """How many joints are driven."""
        return len(self.chain)

    @property
    def reach(self) -> float:
        """How far (m) the tool can be from the base at most: all links in a line, a rail at its end."""
        links = np.linalg.norm(self.chain.origins, axis=1).sum() + np.linalg.norm(self.last_from_tool[:3, 3])
        slides = np.maximum(np.abs(self.lower), np.abs(self.upper))[self.chain.slides].sum()
        return float(links + slides)

    def turned_off_limits(self, joints: FloatArray, margin: float) -> FloatArray:
        """Joints (k, n) with the same poses: what stands within `margin` (rad) of a limit is turned back by 2 pi.

        At a limit an arm cannot follow a line that leads past it. Where a full turn back leads to within the margin of
        the other limit, a joint stays.
        """
        low, high, turn = self.lower + margin, self.upper - margin, 2.0 * np.pi * ~self.chain.slides
        joints = np.where((joints > high) & (joints - turn >= low), joints - turn, joints)
        return np.where((joints < low) & (joints + turn <= high), joints + turn, joints)

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
        pose = world_from_tool if isinstance(world_from_tool, np.ndarray) else world_from_tool.as_matrix()
        if not self._rail:
            return self._searched(pose, near, 0.0)
        if near is not None and len(here := self._searched(pose, near, near[0])):
            return here
        found = np.empty((0, len(self)))
        for count in self._parameters.rail_places:
            places = np.linspace(self.lower[0], self.upper[0], count)
            if near is not None:
                places = places[np.argsort(np.abs(places - near[0]), kind="stable")]
            solver = self._solver
            found = np.concatenate(
                [self._answers(solver.solve(self._without_rail(pose, at), near), pose, near, at) for at in places]
            )
            if len(found):
                break
        return found

    def ik_of_all(
        self, world_from_tools: FloatArray | Sequence[RigidTransform], near: FloatArray | None = None
    ) -> FloatArray:
        """The answers of `ik` to all the poses, or matrices (m, 4, 4), one after the other: (k, n), in less time."""
        poses = (
            world_from_tools
            if isinstance(world_from_tools, np.ndarray)
            else np.array([pose.as_matrix() for pose in world_from_tools])
        )
        if isinstance(self._solver, _ClosedForm) and not self._rail and len(poses):
            raw = self._solver.solve_all(poses)
            ends, start = np.cumsum([len(rows) for rows in raw]), self._zero if near is None else near
            rows, counts = self._checked(np.concatenate(raw), ends, poses, start)
            if not any(_any_straight(raw[n]) for n in np.flatnonzero(counts == 0)):
                return np.asarray(rows)
        return np.concatenate([np.empty((0, len(self))), *(self.ik(pose, near) for pose in poses)])

    def _checked(
        self, raw: FloatArray, ends: NDArray[np.int64], poses: FloatArray, near: FloatArray
    ) -> tuple[FloatArray, NDArray[np.int64]]:
        """`answers_of_all`, whose poses (m, 4, 4) the threads share."""
        parts = []
        for some in np.array_split(np.arange(len(poses)), _THREADS if len(poses) >= _WORTH_CHECKING else 1):
            begin, last = ends[some[0] - 1] if some[0] else 0, ends[some[-1]]
            parts.append((raw[begin:last], ends[some] - begin, poses[some], near))
        if len(parts) == 1:
            return cast(tuple[FloatArray, NDArray[np.int64]], answers_of_all(*self._arm, *parts[0]))
        with ThreadPoolExecutor(_THREADS) as pool:
            rows, counts = zip(*pool.map(lambda part: answers_of_all(*self._arm, *part), parts), strict=True)
        return np.concatenate(rows), np.concatenate(counts)

    def solve(self, world_from_tool: FloatArray) -> FloatArray:
        """All solutions (k, n) for the tool's pose (4, 4), wrapped, whatever the limits; with a rail at zero."""
        return solutions(*self._arm, self._solver.solve(world_from_tool), 0.0, world_from_tool)

    def _searched(self, pose: FloatArray, near: FloatArray | None, rail: float) -> FloatArray:
        """As `ik`, with the rail at that m. A pose with a straight wrist that the closed form misses is searched.

        There it takes one of many solutions, which may be out of reach.
        """
        target = self._without_rail(pose, rail) if self._rail else pose
        raw = self._solver.solve(target, near)
        found = answers(*self._arm, raw, rail, pose, self._zero if near is None else near)
        if len(found) or not self.closed_form or not _any_straight(raw):
            return found
        return self._answers(self._search.solve(target, near), pose, near, rail)

    def _answers(self, raw: FloatArray, pose: FloatArray, near: FloatArray | None, rail: float) -> FloatArray:
        """Those of a solver's rows that bring the tool to its pose, within the limits and nearest to `near` (n,)."""
        return answers(*self._arm, raw, rail, pose, self._zero if near is None else near)

    def _without_rail(self, pose: FloatArray, rail: float) -> FloatArray:
        """A pose (4, 4) of the tool as it is with the rail at zero instead of `rail` m."""
        moved = pose.copy()
        moved[:3, 3] -= rail * self._along_rail
        return moved

    def within_limits(self, rows: FloatArray, near: FloatArray | None = None) -> FloatArray:
        """The rows (k, n) within the joint limits, rounding errors aside; whole turns nearest to `near` (n,)."""
        kept = rows.copy()
        return kept[: keep_within(self.joints, kept, self._zero if near is None else near)]


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


def _closed_form(chain: Chain, base: FloatArray) -> _ClosedForm | None:
    """What solves the joints of a chain at `base` (4, 4) by a closed form; None if there is none."""
    if len(chain) != 6 or chain.slides.any():
        return None
    closed = _ClosedForm(chain, base)
    return closed if closed.known else None


def _any_straight(raw: FloatArray) -> bool:
    """Whether the joint before the last is straight in any of the rows (k, n)."""
    return bool(np.any(np.abs(np.sin(raw[:, -2])) < _STRAIGHT))
