"""Inverse dynamics of a robot: the torques that a motion asks of its drives, and the forces that explain others."""

import numba as nb
import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.robot.robot import Robot
from regrasp.motion.robots.forward import AXIS, KIND, SLIDE, joint_table, link_frames_in
from regrasp.motion.robots.poses import multiply


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _cross(a, b, out):  # type: ignore[no-untyped-def]
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _recursive_newton_euler(base, joints, masses, centers, tensors, q, v, a, gravity):  # type: ignore[no-untyped-def]
    """Efforts (n,): see `ArmDynamics.efforts`."""
    n = len(q)
    frames = link_frames_in(base, joints, q)
    axes, forces, moments = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3))
    spin, turn, pull = np.zeros(3), np.zeros(3), -gravity  # angular velocity and acceleration, linear acceleration
    t, u, w = np.zeros(3), np.zeros(3), np.zeros(3)
    arm, spun = np.zeros(3), np.zeros(3)
    for i in range(n):
        parent, frame = frames[i], frames[i + 1]
        slides = joints[i, KIND] == SLIDE
        for r in range(3):
            for k in range(3):
                axes[i, r] += parent[r, k] * joints[i, AXIS + k]
            arm[r] = frame[r, 3] - parent[r, 3]
        _cross(spin, arm, t)
        _cross(spin, t, u)
        _cross(turn, arm, w)
        for r in range(3):
            pull[r] += w[r] + u[r]
        _cross(spin, axes[i], t)
        for r in range(3):
            if slides:
                pull[r] += 2 * t[r] * v[i] + axes[i, r] * a[i]
            else:
                turn[r] += t[r] * v[i] + axes[i, r] * a[i]
                spin[r] += axes[i, r] * v[i]
        for r in range(3):
            arm[r] = 0.0
            for k in range(3):
                arm[r] += frame[r, k] * centers[i + 1, k]
        _cross(spin, arm, t)
        _cross(spin, t, u)
        _cross(turn, arm, w)
        for r in range(3):
            forces[i, r] = masses[i + 1] * (pull[r] + u[r] + w[r])
        rotation = frame[:3, :3]
        for r in range(3):  # of both in the link's axes, where its tensor is constant
            t[r] = rotation[0, r] * spin[0] + rotation[1, r] * spin[1] + rotation[2, r] * spin[2]
            u[r] = rotation[0, r] * turn[0] + rotation[1, r] * turn[1] + rotation[2, r] * turn[2]
        for r in range(3):
            w[r] = tensors[i + 1, r, 0] * t[0] + tensors[i + 1, r, 1] * t[1] + tensors[i + 1, r, 2] * t[2]
        _cross(t, w, spun)
        for r in range(3):
            spun[r] += tensors[i + 1, r, 0] * u[0] + tensors[i + 1, r, 1] * u[1] + tensors[i + 1, r, 2] * u[2]
        _cross(arm, forces[i], w)
        for r in range(3):
            moments[i, r] = rotation[r, 0] * spun[0] + rotation[r, 1] * spun[1] + rotation[r, 2] * spun[2] + w[r]
    out = np.empty(n)
    for i in range(n - 1, -1, -1):
        out[i] = 0.0
        for r in range(3):
            out[i] += axes[i, r] * (forces[i, r] if joints[i, KIND] == SLIDE else moments[i, r])
        if i:
            for r in range(3):
                arm[r] = frames[i + 1, r, 3] - frames[i, r, 3]
            _cross(arm, forces[i], t)
            for r in range(3):
                forces[i - 1, r] += forces[i, r]
                moments[i - 1, r] += moments[i, r] + t[r]
    return out


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _efforts_of_pull(base, joints, last_from_tool, q, pull):  # type: ignore[no-untyped-def]
    """Efforts (n,): see `ArmDynamics.efforts_of_pull`."""
    n = len(q)
    frames = link_frames_in(base, joints, q)
    tool = multiply(frames[n], last_from_tool)
    place, force = tool[:3, 3].copy(), np.zeros(3)
    axis, arm, moment = np.zeros(3), np.zeros(3), np.zeros(3)
    for r in range(3):
        for k in range(3):
            place[r] += tool[r, k] * pull[k]
            force[r] += tool[r, k] * pull[3 + k]
    out = np.zeros(n)
    for i in range(n):
        for r in range(3):
            axis[r] = 0.0
            for k in range(3):
                axis[r] += frames[i, r, k] * joints[i, AXIS + k]
            arm[r] = place[r] - frames[i + 1, r, 3]
        _cross(arm, force, moment)
        for r in range(3):
            out[i] += axis[r] * (force[r] if joints[i, KIND] == SLIDE else moment[r])
    return out


class ArmDynamics:
    """The rigid-body dynamics of one robot whose base frame stands at `base` (world_from_base).

    Friction in the drives is left out.
    """

    def __init__(self, robot: Robot, base: RigidTransform) -> None:
        inertias = robot.inertias
        self._links = (
            np.ascontiguousarray(base.as_matrix()),
            joint_table(robot.chain),
            inertias.masses,
            inertias.centers,
            inertias.tensors,
        )
        self._last_from_tool = np.ascontiguousarray(robot.chain.last_from_tool)

    def efforts(
        self, q: FloatArray, velocities: FloatArray, accelerations: FloatArray, gravity: FloatArray
    ) -> FloatArray:
        r"""Efforts (n,), N m or N, that this motion of the joints (n,) asks of the drives; `gravity` (3,) m/s2, world.

        By the recursive Newton-Euler algorithm (Luh, Walker, Paul 1980), it is

        .. math:: \tau = M(q) \ddot q + C(q, \dot q) \dot q + g(q)
        """
        return np.asarray(_recursive_newton_euler(*self._links, q, velocities, accelerations, gravity))

    def efforts_of_pull(self, q: FloatArray, pull: FloatArray) -> FloatArray:
        r"""Efforts (n,) by which a force at the hand turns the joints, :math:`J^T f`.

        `pull` (6,) is its place, m, and the force, N, in the tool frame.
        """
        base, joints = self._links[:2]
        return np.asarray(_efforts_of_pull(base, joints, self._last_from_tool, q, pull))
