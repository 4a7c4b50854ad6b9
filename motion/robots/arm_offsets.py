"""By how much an arm's encoders are off, estimated from what a camera sees of the arm.

The result corrects the pose of the hand, not each joint: many sets of six offsets explain one view, and the smallest
of them comes out.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.arrays import FloatArray
from regrasp.motion.robots.forward import spheres_in
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.robots.spheres import sphere_distances


@dataclass(frozen=True)
class JointOffsetParameters:
    """How camera points are matched with the arm's spheres.

    Depth, deviations and gates gave the least error of the tool on 51 pictures of 11 arms: 2.7 mm (at most 5.4 mm)
    where the encoders alone were 10 mm off (at most 22 mm).
    """

    surface_depth: float = 0.0055  # m; the spheres enclose the arm, its surface lies so far inside them
    offset_deviation: float = 0.03  # rad; standard deviation of an encoder's offset
    point_deviation: float = 0.015  # m, of a point: spheres are a rough shape, and errors of neighbours are correlated
    # m from the spheres; one iteration a value; points further off show something else
    gates: tuple[float, ...] = (0.03, 0.021, 0.015, 0.010, *[0.008] * 8)
    search_distance: float = 0.06  # m from the spheres before the first iteration: only such points can pass a gate
    min_points: int = 300  # choice: a third of what shows of a hand beside a piece of foam
    last_links: int = 3  # so many links before the tool count; those nearer to the shoulder err in other ways


def joint_offsets(
    kin: ArmKinematics,
    q: FloatArray,
    opening: float,
    points: FloatArray,
    parameters: JointOffsetParameters = JointOffsetParameters(),
) -> FloatArray:
    r"""What to add (n,) to the encoders' `q` (n,) so that the arm lies where its surface is seen.

    `points` (n, 3) m in the world: what a camera sees of the arm and around it. `opening`: m between the pads. It
    returns zeros where fewer than `min_points` points lie on the arm.

    Gauss-Newton on the maximum a posteriori estimate: :math:`r_i` is the signed distance of point i to the nearest
    sphere's surface, a residual counts while :math:`|r_i|` is below the iteration's gate, and

    .. math:: \min_\delta \sum_i r_i(q + \delta)^2 / \sigma_p^2 + |\delta|^2 / \sigma_\delta^2
    """
    body = kin.robot.body
    seen = body.links > len(kin) - parameters.last_links
    links, local = body.links[seen], body.at(opening)[seen]
    local[:, 3] -= parameters.surface_depth
    points = points[
        sphere_distances(points, spheres_in(kin.link_frames(q), links, local))[0] < parameters.search_distance
    ]
    offsets = np.zeros(len(kin))
    for gate in parameters.gates:
        frames = kin.link_frames(q + offsets)
        spheres = spheres_in(frames, links, local)
        residuals, nearest = sphere_distances(points, spheres)
        inliers = np.abs(residuals) < gate
        if np.count_nonzero(inliers) < parameters.min_points:
            return np.zeros(len(kin))
        jacobian = _jacobian(kin, frames, points[inliers], spheres[nearest[inliers], :3], links[nearest[inliers]])
        offsets -= _step(offsets, jacobian, residuals[inliers], parameters)
    return offsets


def _step(
    offsets: FloatArray, jacobian: FloatArray, residuals: FloatArray, parameters: JointOffsetParameters
) -> FloatArray:
    """The Gauss-Newton step (n,) rad to subtract, by the normal equations."""
    prior, noise = parameters.offset_deviation**2, parameters.point_deviation**2
    information = np.eye(len(offsets)) / prior + jacobian.T @ jacobian / noise
    return np.asarray(np.linalg.solve(information, offsets / prior + jacobian.T @ residuals / noise))


def _jacobian(
    kin: ArmKinematics, frames: FloatArray, points: FloatArray, centers: FloatArray, links: NDArray[np.int64]
) -> FloatArray:
    """Derivative (m, n) m/rad of each point's distance to its sphere by each joint, for link frames (n + 1, 4, 4)."""
    normals = points - centers
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    jacobian = np.zeros((len(points), len(kin)))
    for joint, axis in enumerate(kin.chain.axes):
        frame = frames[joint + 1]
        along = frame[:3, :3] @ axis
        velocities = along if kin.chain.slides[joint] else np.cross(along, points - frame[:3, 3])
        jacobian[:, joint] = np.where(
            links > joint, -np.einsum("ij,ij->i", normals, np.broadcast_to(velocities, normals.shape)), 0.0
        )
    return jacobian
