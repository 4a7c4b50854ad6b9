"""Contact localisation: where on an arm a force acts that its joints feel."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.arrays import FloatArray
from regrasp.motion.robots.contact_guard import Touch
from regrasp.motion.robots.kinematics import ArmKinematics


@dataclass(frozen=True)
class ContactPlaceParameters:
    """How well a force must explain what was felt, and how much round its place counts as occupied."""

    unexplained: float = 0.02  # share of a joint's greatest effort that may be left unexplained; choice
    usual_force: float = 10.0  # N; of two forces that explain a touch as well the smaller is the likelier one; choice
    map_error: float = 0.02  # m that a thing which is touched may be off the map; choice
    off_map: float = 0.04  # m; what is further from all that is mapped is as unlikely, no more; tuned
    radius: float = 0.04  # m of the disc that counts as the surface which was felt; choice
    depth: float = 0.02  # m behind that surface; choice


def contact_place(
    kinematics: ArmKinematics,
    spheres: FloatArray,
    links: NDArray[np.int64],
    touch: Touch,
    clearances: FloatArray,
    parameters: ContactPlaceParameters = ContactPlaceParameters(),
) -> tuple[FloatArray, FloatArray]:
    r"""Where a touch was, (3,) m in the world, and the unit vector (3,) from there into the thing.

    Each of the arm's `spheres` (m, 4) m, world, on the chain's `links` (m,), is tried as the place. The force that
    explains the felt efforts best from there is

    .. math:: f_s = \arg\min_f |W (r - J_s^T f)|^2 + |f|^2 / f_0^2

    with the Jacobian of the sphere's centre, and W the inverse of the efforts that may be left unexplained. To this
    cost comes the square of the sphere's distance to what is on the map, `clearances` (m,) m, by the map's error. Of
    the spheres whose force works against their motion the one with the least cost is taken: the idea of the contact
    particle filter (Manuelli and Tedrake 2016), with spheres in place of particles.
    """
    jacobians = _sphere_jacobians(kinematics, spheres[:, :3], links, touch.joints)
    weights = 1.0 / (parameters.unexplained * kinematics.chain.torques)
    weighted = jacobians * weights
    regular = np.eye(3) / parameters.usual_force**2
    normal = weighted @ np.swapaxes(weighted, 1, 2) + regular
    forces = np.linalg.solve(normal, (weighted @ (weights * touch.efforts))[..., None])[..., 0]
    errors = weights * touch.efforts - np.einsum("sij,si->sj", weighted, forces)
    costs = (errors**2).sum(axis=1) + np.einsum("si,ij,sj->s", forces, regular, forces)
    costs += (np.clip(clearances, 0.0, parameters.off_map) / parameters.map_error) ** 2
    power = np.einsum("sij,j,si->s", jacobians, touch.velocities, forces)
    if (power < 0.0).any():
        costs[power >= 0.0] = np.inf
    else:  # no force explains it: what moves fastest touched, on the side to which it moves
        speeds = np.einsum("sij,j->si", jacobians, touch.velocities)
        costs, forces = -np.linalg.norm(speeds, axis=1), -speeds
    best = int(np.argmin(costs))
    inward = -forces[best] / max(float(np.linalg.norm(forces[best])), 1e-12)
    return spheres[best, :3] + spheres[best, 3] * inward, inward


def felt_points(
    place: FloatArray, inward: FloatArray, spacing: float, parameters: ContactPlaceParameters = ContactPlaceParameters()
) -> FloatArray:
    """Points (n, 3) m, `spacing` m apart, of a disc about a `place` (3,) that was felt, and behind it."""
    across = np.linalg.svd(inward[None])[2][1:]
    steps = np.arange(-parameters.radius, parameters.radius + 1e-9, spacing)
    depths = np.arange(0.0, parameters.depth + 1e-9, spacing)
    u, v, deep = (part.ravel() for part in np.meshgrid(steps, steps, depths, indexing="ij"))
    inside = u**2 + v**2 <= parameters.radius**2
    return np.asarray(place + (np.stack([u, v, deep], axis=1) @ np.vstack([across, inward]))[inside])


def _sphere_jacobians(
    kinematics: ArmKinematics, centers: FloatArray, links: NDArray[np.int64], q: FloatArray
) -> FloatArray:
    """Derivatives (m, 3, n) of places (m, 3) m on the links (m,) by the joints, in the world."""
    frames, chain = kinematics.link_frames(q), kinematics.chain
    axes = np.einsum("nij,nj->ni", frames[:-1, :3, :3], chain.axes)
    arms = centers[:, None, :] - frames[None, 1:, :3, 3]
    columns = np.where(chain.slides[:, None], axes, np.cross(axes, arms))
    columns[np.arange(len(chain)) >= links[:, None]] = 0.0
    return np.asarray(np.swapaxes(columns, 1, 2))
