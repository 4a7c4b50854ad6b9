"""The rest shape of a plugged cable, by energy minimisation, without the physics engine."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import HiddenCable
from regrasp.interfaces.scene import EARTH_GRAVITY, Gravity


@dataclass(frozen=True)
class RestShapeParameters:
    """How the energy of a resting cable is stated and minimised."""

    stretching: float = 1e4  # stiffness of a link against stretching, in k / l^2: it then gives way by less than 0.1 mm
    max_iterations: int = 5000  # of L-BFGS-B; a bound only: it stops by itself at the minimum


def rest_shape(
    cable: HiddenCable,
    world_from_connector: RigidTransform,
    connector_length: float,
    gravity: Gravity,
    parameters: RestShapeParameters = RestShapeParameters(),
) -> FloatArray:
    """Ends (n + 1, 3) m, in the world, of the n links of a cable whose loose end a connector holds at this pose.

    The minimum of the energy of a discretised rod (Bergou et al. 2008, "Discrete Elastic Rods", without twist):

    .. math:: E = \\sum_i k_i |u_{i+1} - u_i|^2 / 2 + \\sum_i m g z_i + \\sum_i s (|d_i| - l)^2 / 2

    d are the links between their ends, u = d / l, k = EI / l is the bending stiffness (2 k at the clamp), m the mass of
    a link, z the height of its middle, s the stiffness against stretching. u_0 is the direction of the clamp; the last
    link lies along the connector. Contacts are left out. If the distance of the ends is nearly the cable's length, this
    shape is within 3 mm of the simulated one; a slack cable has several minima and may rest in another one.
    """
    n, link = cable.links, cable.length / cable.links
    weight = cable.mass_per_length * link * (0.0 if gravity == "zero" else EARTH_GRAVITY)
    bending = np.full((n, 1), (cable.stiffness.zero if gravity == "zero" else cable.stiffness.earth) / link)
    stretching = parameters.stretching * float(bending[0, 0]) / link**2
    bending[0] *= 2
    anchor = np.asarray(cable.anchor)
    clamp = np.asarray(cable.anchor_axis) / np.linalg.norm(cable.anchor_axis)
    rear = 0.5 * connector_length
    last = world_from_connector.apply([[-rear - link, 0.0, 0.0], [-rear, 0.0, 0.0]])

    def points_of(free: FloatArray) -> FloatArray:
        return np.vstack([anchor, free.reshape(-1, 3), last])

    def energy(free: FloatArray) -> tuple[float, FloatArray]:
        points = points_of(free)
        links = np.diff(points, axis=0)
        lengths = np.linalg.norm(links, axis=1, keepdims=True)
        turns = np.diff(np.vstack([clamp, links / link]), axis=0)
        height = float(np.sum(points[1:, 2] + points[:-1, 2])) / 2
        bent, stretched = float(np.sum(bending * turns**2)), float(np.sum((lengths - link) ** 2))
        by_turn = bending * turns / link
        by_link = by_turn - np.vstack([by_turn[1:], np.zeros(3)]) + stretching * (1 - link / lengths) * links
        by_point = by_link[:-1] - by_link[1:]
        by_point[:, 2] += weight
        return bent / 2 + weight * height + stretching * stretched / 2, by_point[:-1].ravel()

    guess = _cubic(anchor, clamp * cable.length, last[0], (last[1] - last[0]) * n, n)
    found = minimize(
        energy,
        guess[1:-1].ravel(),
        jac=True,
        method="L-BFGS-B",
        options={"maxiter": parameters.max_iterations, "maxfun": 10 * parameters.max_iterations},
    )
    return points_of(found.x)


def _cubic(start: FloatArray, out: FloatArray, end: FloatArray, into: FloatArray, count: int) -> FloatArray:
    """Points (count, 3) of the cubic from `start` to `end` with these tangents there (Hermite)."""
    s = np.linspace(0.0, 1.0, count)[:, None]
    ends = (2 * s**3 - 3 * s**2 + 1) * start + (3 * s**2 - 2 * s**3) * end
    points: FloatArray = ends + (s**3 - 2 * s**2 + s) * out + (s**3 - s**2) * into
    return points
