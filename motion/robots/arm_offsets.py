"""By how much an arm's encoders are off, estimated from what a camera sees of the arm.

The result corrects the pose of the hand, not each joint: many sets of six offsets explain one view, and the smallest
of them comes out.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.arrays import FloatArray
from regrasp.motion.robots.kinematics import AXES, ArmKinematics, world_spheres
from regrasp.motion.robots.spheres import SPHERE_LINKS, sphere_distances, spheres_at


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
    first_link: int = 4  # the forearm beyond its roll; links nearer to the shoulder err in other ways than the hand


def joint_offsets(
    kin: ArmKinematics,
    q: FloatArray,
    opening: float,
    points: FloatArray,
    parameters: JointOffsetParameters = JointOffsetParameters(),
) -> FloatArray:
    r"""What to add (6,) rad to the encoders' `q` (6,) so that the arm lies where its surface is seen.

    `points` (n, 3) m in the world: what a camera sees of the arm and around it. `opening`: m between the pads. It
    returns zeros where fewer than `min_points` points lie on the arm.

    Gauss-Newton on the maximum a posteriori estimate: :math:`r_i` is the signed distance of point i to the nearest
    sphere's surface, a residual counts while :math:`|r_i|` is below the iteration's gate, and

    .. math:: \min_\delta \sum_i r_i(q + \delta)^2 / \sigma_p^2 + |\delta|^2 / \sigma_\delta^2
    """
    seen = parameters.first_link <= SPHERE_LINKS
    links, local = SPHERE_LINKS[seen], spheres_at(opening)[seen]
    local[:, 3] -= parameters.surface_depth
    points = points[sphere_distances(points, world_spheres(kin.base, q, links, local))[0] < parameters.search_distance]
    offsets = np.zeros(6)
    for gate in parameters.gates:
        spheres = world_spheres(kin.base, q + offsets, links, local)
        residuals, nearest = sphere_distances(points, spheres)
        inliers = np.abs(residuals) < gate
        if np.count_nonzero(inliers) < parameters.min_points:
            return np.zeros(6)
        jacobian = _jacobian(
            kin.link_frames(q + offsets), points[inliers], spheres[nearest[inliers], :3], links[nearest[inliers]]
        )
        offsets -= _step(offsets, jacobian, residuals[inliers], parameters)
    return offsets


def _step(
    offsets: FloatArray, jacobian: FloatArray, residuals: FloatArray, parameters: JointOffsetParameters
) -> FloatArray:
    """The Gauss-Newton step (6,) rad to subtract, by the normal equations."""
    prior, noise = parameters.offset_deviation**2, parameters.point_deviation**2
    information = np.eye(6) / prior + jacobian.T @ jacobian / noise
    return np.asarray(np.linalg.solve(information, offsets / prior + jacobian.T @ residuals / noise))


def _jacobian(frames: FloatArray, points: FloatArray, centers: FloatArray, links: NDArray[np.int64]) -> FloatArray:
    """Derivative (n, 6) m/rad of each point's distance to its sphere by each joint, for link frames (7, 4, 4)."""
    normals = points - centers
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    jacobian = np.zeros((len(points), 6))
    for joint, axis in enumerate(AXES):
        frame = frames[joint + 1]
        velocities = np.cross(frame[:3, axis], points - frame[:3, 3])
        jacobian[:, joint] = np.where(links > joint, -np.einsum("ij,ij->i", normals, velocities), 0.0)
    return jacobian
