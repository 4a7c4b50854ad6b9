"""Inverse kinematics of a camera on an arm: which joint positions bring it to a place and direction of view."""

from collections.abc import Iterator

import numba as nb
import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray, Mask
from regrasp.interfaces.wall_time import counts_as
from regrasp.motion.robots.answers import is_new, wrap
from regrasp.motion.robots.forward import link_frames_in
from regrasp.motion.robots.ik_parameters import InverseKinematicsParameters
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.robots.poses import inverse, multiply, rotation_matrix


@counts_as("planning")
def ik_view(
    kin: ArmKinematics,
    world_from_camera: RigidTransform,
    mount_from_camera: RigidTransform,
    parameters: InverseKinematicsParameters = InverseKinematicsParameters(),
) -> FloatArray:
    """Joint positions (k, n) that bring a camera on an arm to a place and direction of view, upright images first.

    The position is met within 2 mm and the optical axis within 0.5 degrees. A camera on the link before the last is
    moved by all joints but one, so its roll about the optical axis cannot be chosen; the last joint stays 0. Raises
    ValueError if it does not look along that joint's axis there, or sits nearer to the base.
    """
    wanted = world_from_camera.as_matrix()
    index, link_from_mount = kin.robot.mounted
    link_from_camera = multiply(link_from_mount, mount_from_camera.as_matrix())
    if index == len(kin):
        return _by_the_last_link(kin, wanted, link_from_camera, parameters)
    along = float(kin.chain.axes[-1] @ link_from_camera[:3, 2])
    if index != len(kin) - 1 or kin.robot.rail or abs(along) < 1 - 1e-6:
        raise ValueError(
            f"the mount of {kin.robot.title} must be on the last link, or on the one before and look along the last "
            "joint's axis, and then on no rail"
        )
    found = np.array(list(_solutions(kin, wanted, link_from_camera, along, parameters))).reshape(-1, len(kin))
    tolerances = parameters.camera_position, np.sin(parameters.camera_axis)
    near, upright = _views(kin.base, kin.joints, index, found, wanted, link_from_camera, *tolerances)
    order = np.argsort(-upright[near], kind="stable")
    return kin.within_limits(_distinct(found[near][order], parameters.distinct))


def _by_the_last_link(
    kin: ArmKinematics, wanted: FloatArray, last_from_camera: FloatArray, parameters: InverseKinematicsParameters
) -> FloatArray:
    """With all rolls, upright ones first: the camera moves with the tool."""
    tool = multiply(wanted, multiply(inverse(last_from_camera), kin.last_from_tool))
    return kin.ik_of_all(np.array([_rolled(tool, wanted, roll) for roll in parameters.roll_starts]))


def _solutions(
    kin: ArmKinematics,
    wanted: FloatArray,
    mount: FloatArray,
    along: float,
    parameters: InverseKinematicsParameters,
) -> Iterator[FloatArray]:
    """Fixed-point iteration over the camera's roll: a solution's last joint says by how much the roll is off.

    `mount` (4, 4) is the camera's pose in its link; `along` is 1 or -1: which way round the last joint turns it.
    """
    link_from_tool = kin.last_from_tool.copy()
    link_from_tool[:3, 3] += kin.chain.origins[-1]
    tool = wanted @ np.linalg.inv(multiply(inverse(link_from_tool), mount))
    for start in parameters.roll_starts:
        for q in kin.solve(_rolled(tool, wanted, start)):
            roll = start
            for _ in range(parameters.roll_iterations):
                if abs(q[-1]) < parameters.roll:
                    yield np.append(q[:-1], 0.0)
                    break
                roll -= along * q[-1]
                target = _rolled(tool, wanted, roll)
                branches = kin.solve(target)
                if not len(branches):
                    break
                q = branches[_nearest(branches, q)]


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _distinct(rows: FloatArray, distinct: float) -> FloatArray:
    """The rows (k, n) without repetitions, order kept."""
    kept, count = np.empty_like(rows), 0
    for row in rows:
        if is_new(row, kept, count, distinct):
            kept[count] = row
            count += 1
    return kept[:count]


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _views(
    base: FloatArray,
    joints: FloatArray,
    index: int,
    rows: FloatArray,
    wanted: FloatArray,
    mount: FloatArray,
    max_distance: float,
    max_sine: float,
) -> tuple[Mask, FloatArray]:
    """Which joint vectors (k, n) bring the camera to `wanted`, and the cosines (k,) between its up and the wanted.

    The camera has the pose `mount` (4, 4) in the link of that `index`.
    """
    near, upright = np.empty(len(rows), np.bool_), np.empty(len(rows))
    for n in range(len(rows)):
        camera = multiply(link_frames_in(base, joints, rows[n])[index], mount)
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
def _rolled(tool: FloatArray, wanted: FloatArray, roll: float) -> FloatArray:
    """The tool's pose turned by `roll` rad about the wanted optical axis through the wanted camera position."""
    turn = np.eye(4)
    turn[:3, :3] = rotation_matrix(roll * wanted[:3, 2])
    for r in range(3):
        turn[r, 3] = wanted[r, 3] - np.sum(turn[r, :3] * wanted[:3, 3])
    return multiply(turn, tool)


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def _nearest(branches: FloatArray, q: FloatArray) -> int:
    """The branch whose joints but the last are nearest to those of `q` and whose last joint is nearest to 0."""
    best, least, last = 0, np.inf, branches.shape[1] - 1
    for row in range(len(branches)):
        off = 0.0
        for joint in range(last):
            off += abs(wrap(branches[row, joint] - q[joint]))
        off += abs(branches[row, last])
        if off < least:
            best, least = row, off
    return best
