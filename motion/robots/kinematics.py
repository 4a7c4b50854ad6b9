"""Forward and inverse kinematics: where the links are, and which joint angles bring tool or camera to a pose.

ViperX 300 S, maker's kinematics with the base height of rtb-data's URDF. Joints: waist, shoulder, elbow, forearm roll,
wrist angle, wrist rotate. At zero the upper arm stands upright, the forearm points forward, and every link frame is
parallel to the base frame.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numba as nb
import numpy as np
from eaik.IK_HP import HPRobot
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray, Mask
from regrasp.interfaces.wall_time import counts_as
from regrasp.motion.robots.poses import multiply, rotation_matrix

# Joint origins in the parent link, metres, and rotation axes (0 x, 1 y, 2 z).
ORIGINS = np.array(
    [[0, 0, 0.0787], [0, 0, 0.04805], [0.05955, 0, 0.3], [0.2, 0, 0], [0.1, 0, 0], [0.069744, 0, 0]], dtype=np.float64
)
AXES = np.array([2, 1, 1, 0, 1, 0])
TOOL_OFFSET = np.array([0.1252, 0.0, 0.0])  # the pads' centre in the last link; the maker's ee_gripper is 0.018 behind

# Limits, intersected over the maker's documentation and rtb-data's URDF.
LOWER = np.deg2rad([-180.0, -106.0, -101.0, -180.0, -107.0, -180.0])
UPPER = np.deg2rad([180.0, 72.0, 92.0, 180.0, 128.0, 180.0])
VELOCITY_LIMIT = np.full(6, np.pi)  # rad/s, the maker's servos
ACCELERATION_LIMIT = np.full(6, 5.0)  # rad/s2, the maker's MoveIt configuration for its six-joint arms

_ROUNDING = 1e-9  # rad past a joint's limit that are rounding errors


@dataclass(frozen=True)
class InverseKinematicsParameters:
    """Tolerances of inverse kinematics; a solution that misses its pose by more is dropped."""

    position: float = 1e-4  # m, of the tool; choice: far below the arm's accuracy
    angle: float = 1e-3  # rad, of the tool
    camera_position: float = 0.002  # m, of a wrist camera; choice: it looks from 0.3 m
    camera_axis: float = float(np.deg2rad(0.5))  # rad, of a wrist camera's optical axis; choice
    distinct: float = 1e-3  # rad; solutions whose joints all differ by less are one
    roll: float = 1e-4  # rad of the last joint at which a camera's roll has converged
    roll_iterations: int = 20  # choice: bounds the time spent on a pose that it does not reach
    roll_starts: tuple[float, ...] = (0.0, 0.5 * np.pi, -0.5 * np.pi, np.pi)  # rad from which a camera's roll is sought


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def link_frames_in(base: FloatArray, q: FloatArray) -> FloatArray:
    """Frames of base and links 1-6 (7, 4, 4) for a base frame (4, 4) and joints (6,) rad."""
    out = np.zeros((7, 4, 4))
    out[0] = base
    for i in range(6):
        parent, frame = out[i], out[i + 1]
        c, s = np.cos(q[i]), np.sin(q[i])
        a = AXES[i]
        u, v = (a + 1) % 3, (a + 2) % 3
        for r in range(3):
            frame[r, 3] = parent[r, 3]
            for k in range(3):
                frame[r, 3] += parent[r, k] * ORIGINS[i, k]
            frame[r, a] = parent[r, a]
            frame[r, u] = c * parent[r, u] + s * parent[r, v]
            frame[r, v] = c * parent[r, v] - s * parent[r, u]
        frame[3, 3] = 1.0
    return out


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def world_spheres(base: FloatArray, q: FloatArray, links: NDArray[np.int64], local: FloatArray) -> FloatArray:
    """Spheres (n, 4) m in the world, from those in the frames of their `links` (n,)."""
    return spheres_in(link_frames_in(base, q), links, local)


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def spheres_in(frames: FloatArray, links: NDArray[np.int64], local: FloatArray) -> FloatArray:
    """`world_spheres` with the frames (7, 4, 4) of the links."""
    out = np.empty_like(local)
    for n in range(local.shape[0]):
        f = frames[links[n]]
        for r in range(3):
            out[n, r] = f[r, 0] * local[n, 0] + f[r, 1] * local[n, 1] + f[r, 2] * local[n, 2] + f[r, 3]
        out[n, 3] = local[n, 3]
    return out


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def wrap(q: FloatArray) -> FloatArray:
    """Angles brought into [-pi, pi)."""
    return (q + np.pi) % (2 * np.pi) - np.pi


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _reaches(base: FloatArray, q: FloatArray, target: FloatArray, max_distance: float, max_angle: float) -> bool:
    """Whether joints (6,) bring the tool to a target (4, 4) within the tolerances, m and rad."""
    frame = link_frames_in(base, q)[6]
    position, rotation = 0.0, 0.0
    for r in range(3):
        position += (frame[r, 3] + frame[r, 0] * TOOL_OFFSET[0] - target[r, 3]) ** 2
        for c in range(3):
            rotation += (frame[r, c] - target[r, c]) ** 2
    # |A - B| (Frobenius) = sqrt(8) sin(angle / 2): exact near zero, unlike the arc cosine of the trace
    return position < max_distance**2 and rotation < 8 * np.sin(max_angle / 2) ** 2


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _with_straight_wrist(base: FloatArray, raw: FloatArray, target: FloatArray) -> FloatArray:
    """The solution `raw` (6,) with a straight wrist, where the solver only gives a least-squares orientation."""
    arm = np.array([raw[0], raw[1], raw[2], 0.0, 0.0, 0.0])
    forearm = link_frames_in(base, arm)[3]
    sine, cosine = 0.0, 0.0
    for r in range(3):
        sine += forearm[r, 2] * target[r, 1] - forearm[r, 1] * target[r, 2]
        cosine += forearm[r, 1] * target[r, 1] + forearm[r, 2] * target[r, 2]
    arm[5] = np.arctan2(sine, cosine)
    return wrap(arm)


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _is_new(row: FloatArray, rows: FloatArray, count: int, distinct: float) -> bool:
    """Whether no row of the first `count` differs from this one by `distinct` rad at most in each joint."""
    for other in range(count):
        joint = 0
        while joint < len(row) and abs(wrap(row[joint] - rows[other, joint])) <= distinct:
            joint += 1
        if joint == len(row):
            return False
    return True


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _solutions(
    base: FloatArray, raw: FloatArray, target: FloatArray, max_distance: float, max_angle: float, distinct: float
) -> FloatArray:
    """The solver's answers `raw` (n, 6) that bring the tool to a target (4, 4), wrapped, without repetitions."""
    out, count, wrapped = np.empty_like(raw), 0, wrap(raw)
    for row in range(raw.shape[0]):
        q = wrapped[row]
        if not _reaches(base, q, target, max_distance, max_angle):
            q = _with_straight_wrist(base, q, target)
            if not _reaches(base, q, target, max_distance, max_angle):
                continue
        if _is_new(q, out, count, distinct):
            out[count] = q
            count += 1
    return out[:count]


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _within_limits(rows: FloatArray) -> FloatArray:
    """The rows within the joint limits, rounding errors aside."""
    out, count = np.empty_like(rows), 0
    for row in range(rows.shape[0]):
        inside = np.minimum(np.maximum(rows[row], LOWER), UPPER)
        if np.all(np.abs(inside - rows[row]) < _ROUNDING):
            out[count] = inside
            count += 1
    return out[:count]


class ArmKinematics:
    """One arm whose base frame stands at `base` (world_from_base)."""

    def __init__(
        self, base: RigidTransform, parameters: InverseKinematicsParameters = InverseKinematicsParameters()
    ) -> None:
        self._parameters = parameters
        self.base: FloatArray = np.ascontiguousarray(base.as_matrix())
        self._base_inverse = np.linalg.inv(self.base)
        self._solver = HPRobot(np.eye(3)[AXES], np.vstack([ORIGINS, TOOL_OFFSET]))

    def link_frames(self, q: FloatArray) -> FloatArray:
        """World frames (7, 4, 4) of the base and the six links, for joints (6,) rad."""
        return np.asarray(link_frames_in(self.base, np.asarray(q, float)))

    def tool(self, q: FloatArray) -> RigidTransform:
        """world_from_tool: x forward along the gripper, y the direction in which the fingers close."""
        return RigidTransform.from_matrix(self.tool_matrix(q))

    def tool_matrix(self, q: FloatArray) -> FloatArray:
        """`tool` as a matrix (4, 4)."""
        frame: FloatArray = self.link_frames(q)[6]
        frame[:3, 3] += frame[:3, :3] @ TOOL_OFFSET
        return frame

    def wrist(self, q: FloatArray) -> RigidTransform:
        """world_from_wrist: the link before the last joint; a wrist camera is fixed on it."""
        return RigidTransform.from_matrix(self.link_frames(q)[5])

    def ik(self, world_from_tool: RigidTransform | FloatArray) -> FloatArray:
        """All joint vectors (n, 6) rad within the limits that bring the tool to a pose; (0, 6) when there is none.

        The pose may be a matrix (4, 4). Every row is checked by forward kinematics (0.1 mm, 1 mrad): the solver also
        answers for poses out of reach.
        """
        target = world_from_tool if isinstance(world_from_tool, np.ndarray) else world_from_tool.as_matrix()
        return np.asarray(_within_limits(self._solve(target)))

    @counts_as("planning")
    def ik_view(self, world_from_camera: RigidTransform, wrist_from_camera: RigidTransform) -> FloatArray:
        """Joint vectors (n, 6) rad that bring a wrist camera to a place and direction of view, upright images first.

        Only five joints move the camera, so its roll about the optical axis cannot be chosen. The position is met
        within 2 mm and the axis within 0.5 degrees; the last joint stays 0. Raises ValueError unless the optical axis
        is the wrist link's x axis.
        """
        wanted = world_from_camera.as_matrix()
        mount = wrist_from_camera.as_matrix()
        if mount[0, 2] < 1 - 1e-6:
            raise ValueError(f"the camera must look along the wrist link's x axis, not along {mount[:3, 2]}")
        limits = self._parameters
        found = np.array(list(self._view_solutions(wanted, mount))).reshape(-1, 6)
        near, upright = _views(self.base, found, wanted, mount, limits.camera_position, np.sin(limits.camera_axis))
        order = np.argsort(-upright[near], kind="stable")
        return np.asarray(_within_limits(_distinct(found[near][order], limits.distinct)))

    def _solve(self, target: FloatArray) -> FloatArray:
        """`ik` of a (4, 4) matrix without regard to the joint limits."""
        raw = self._raw(multiply(self._base_inverse, target))
        limits = self._parameters
        return np.asarray(_solutions(self.base, raw, target, limits.position, limits.angle, limits.distinct))

    def _raw(self, base_from_tool: FloatArray) -> FloatArray:
        """The solver's answers (n, 6) rad, some of which miss the pose."""
        return np.array(self._solver.IK(base_from_tool).Q, float).reshape(-1, 6)

    def _view_solutions(self, wanted: FloatArray, mount: FloatArray) -> Iterator[FloatArray]:
        """Fixed-point iteration over the camera's roll: a solution's last joint says by how much the roll is off."""
        tool_from_mount = mount.copy()
        tool_from_mount[0, 3] -= ORIGINS[5, 0] + TOOL_OFFSET[0]
        tool_target = wanted @ np.linalg.inv(tool_from_mount)
        limits = self._parameters
        tolerances = (limits.position, limits.angle, limits.distinct)
        for start in limits.roll_starts:
            for q in self._solve(_rolled(tool_target, wanted, start)):
                roll = start
                for _ in range(limits.roll_iterations):
                    if abs(q[5]) < limits.roll:
                        yield np.append(q[:5], 0.0)
                        break
                    roll -= q[5]
                    target, in_base = _rolled_target(self._base_inverse, tool_target, wanted, roll)
                    q, reached = _nearest_solution(self.base, self._raw(in_base), target, q, *tolerances)
                    if not reached:
                        break


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _distinct(rows: FloatArray, distinct: float) -> FloatArray:
    """The rows (n, 6) without repetitions, order kept."""
    kept, count = np.empty_like(rows), 0
    for row in rows:
        if _is_new(row, kept, count, distinct):
            kept[count] = row
            count += 1
    return kept[:count]


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _views(
    base: FloatArray, rows: FloatArray, wanted: FloatArray, mount: FloatArray, max_distance: float, max_sine: float
) -> tuple[Mask, FloatArray]:
    """Which joint vectors (n, 6) bring the camera to `wanted`, and the cosines (n,) between its up and the wanted."""
    near, upright = np.empty(len(rows), np.bool_), np.empty(len(rows))
    for n in range(len(rows)):
        camera = multiply(link_frames_in(base, rows[n])[5], mount)
        distance, sine, cosine, up = 0.0, 0.0, 0.0, 0.0
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            distance += (camera[i, 3] - wanted[i, 3]) ** 2
            sine += (camera[j, 2] * wanted[k, 2] - camera[k, 2] * wanted[j, 2]) ** 2
            cosine += camera[i, 2] * wanted[i, 2]
            up += camera[i, 1] * wanted[i, 1]
        near[n] = distance < max_distance**2 and sine < max_sine**2 and cosine > 0.0
        upright[n] = up
    return near, upright


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _rolled_target(
    base_inverse: FloatArray, tool_target: FloatArray, wanted: FloatArray, roll: float
) -> tuple[FloatArray, FloatArray]:
    """`_rolled` in the world and in the base frame."""
    target = _rolled(tool_target, wanted, roll)
    return target, multiply(base_inverse, target)


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _nearest_solution(
    base: FloatArray,
    raw: FloatArray,
    target: FloatArray,
    q: FloatArray,
    max_distance: float,
    max_angle: float,
    distinct: float,
) -> tuple[FloatArray, bool]:
    """The one of `_solutions` that is nearest to `q` (6,) rad, and whether there is any."""
    branches = _solutions(base, raw, target, max_distance, max_angle, distinct)
    if len(branches) == 0:
        return q, False
    return branches[_nearest(branches, q)], True


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _rolled(tool_target: FloatArray, wanted: FloatArray, roll: float) -> FloatArray:
    """The tool target turned by `roll` rad about the wanted optical axis through the wanted camera position."""
    turn = np.eye(4)
    turn[:3, :3] = rotation_matrix(roll * wanted[:3, 2])
    for r in range(3):
        turn[r, 3] = wanted[r, 3] - np.sum(turn[r, :3] * wanted[:3, 3])
    return multiply(turn, tool_target)


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _nearest(branches: FloatArray, q: FloatArray) -> int:
    """The branch whose first five joints are nearest to those of `q` and whose last joint is nearest to 0."""
    best, least = 0, np.inf
    for row in range(len(branches)):
        off = 0.0
        for joint in range(5):
            off += abs(wrap(branches[row, joint] - q[joint]))
        off += abs(branches[row, 5])
        if off < least:
            best, least = row, off
    return best
