"""Fits a capped cylinder of known size to what a camera saw of it: depth points, and rays along its silhouette.

Everything is in the camera's optical frame, metres.
"""

from dataclasses import dataclass

import numpy as np

from regrasp.interfaces.arrays import FloatArray, Mask
from regrasp.perception.pose.fused import cylinder


@dataclass(frozen=True)
class CylinderFitParameters:
    """Loss, noise and stopping rules of the fit."""

    max_steps: int = 20  # of Levenberg-Marquardt
    min_gain: float = 1e-4  # share of the cost that a step must save to be worth another
    search_steps: int = 12  # of the golden section: 0.1 m shrinks to 0.3 mm, where the distance is off by micrometres
    min_facing: float = 0.1  # choice: cosine of ray and normal; at grazing surfaces the smaller ones count as this
    surface_noise: float = 0.0005  # m; choice: deviation of depth readings where the surface runs along the ray


@dataclass(frozen=True, eq=False)
class Observation:
    """What was seen of the body."""

    points: FloatArray  # (n, 3) m, on its surface
    point_deviations: FloatArray  # (n,) m, along their rays
    rays: FloatArray  # (m, 3) unit vectors along its silhouette
    ray_deviations: FloatArray  # (m,) rad
    occluded: Mask  # (m,): an occluder begins at this ray, and the body may go on beyond it
    point_share: float  # share of the points that count as independent
    ray_share: float  # share of the rays, likewise


@dataclass(frozen=True, eq=False)
class Cylinder:
    """A capped cylinder: `center` (3,) m, unit `axis` (3,), `radius` and `length` m."""

    center: FloatArray
    axis: FloatArray
    radius: float
    length: float


@dataclass(frozen=True, eq=False)
class CylinderFit(Cylinder):
    """A cylinder that was fitted, with its `cost` and its `covariance` (5, 5).

    The covariance is that of the centre, then of the rotations about `tilt_axes` (2, 3), two unit vectors square to the
    axis. What the observation leaves open has the deviation of the body's length, or 1 rad.
    """

    cost: float
    covariance: FloatArray
    tilt_axes: FloatArray


def fit_cylinder(
    observation: Observation,
    start: Cylinder,
    cauchy_scale: float,
    parameters: CylinderFitParameters = CylinderFitParameters(),
    max_steps: int | None = None,
) -> CylinderFit:
    r"""The cylinder of the size of `start` that explains the observation best, by Levenberg-Marquardt from there.

    The residuals :math:`r_i` are those of the points along their rays, and the signed distances of the rays from the
    body. With their deviations :math:`\sigma_i`, their shares :math:`s_i` and the Cauchy loss of the scale :math:`c`,
    in deviations, the cost is

    .. math:: \frac{c^2}{2} \sum_i s_i \ln\left(1 + \frac{r_i^2}{\sigma_i^2 c^2}\right)

    `max_steps` overrides the parameters' own.
    """
    center, axis = np.ascontiguousarray(start.center, float), np.ascontiguousarray(start.axis, float)
    center, axis, cost, covariance, tilt_axes = cylinder.levenberg_marquardt(
        observation.points,
        observation.point_deviations,
        observation.rays,
        observation.ray_deviations,
        observation.occluded,
        observation.point_share,
        observation.ray_share,
        center,
        axis,
        start.radius,
        start.length / 2,
        cauchy_scale,
        parameters.min_facing,
        parameters.surface_noise,
        parameters.search_steps,
        parameters.max_steps if max_steps is None else max_steps,
        parameters.min_gain,
    )
    return CylinderFit(center, axis, start.radius, start.length, cost, covariance, tilt_axes)


def thinned(observation: Observation, count: int) -> Observation:
    """The observation with about `count` points and as many rays; each also counts for those left out."""
    p, r = 1 + len(observation.points) // count, 1 + len(observation.rays) // count
    # Copies, as the fit is compiled for arrays without gaps.
    return Observation(
        observation.points[::p].copy(),
        observation.point_deviations[::p].copy(),
        observation.rays[::r].copy(),
        observation.ray_deviations[::r].copy(),
        observation.occluded[::r].copy(),
        observation.point_share * p,
        observation.ray_share * r,
    )


def closest_approaches(
    rays: FloatArray, body: Cylinder, parameters: CylinderFitParameters = CylinderFitParameters()
) -> tuple[FloatArray, FloatArray]:
    """For unit `rays` (n, 3): the least signed distance (n,) m from the body, and the range (n,) m where it is.

    The distance is below 0 where the ray goes through the body.
    """
    unit_rays, half = np.ascontiguousarray(rays, float), body.length / 2
    return cylinder.closest_approaches(unit_rays, body.center, body.axis, body.radius, half, parameters.search_steps)


def depth_residuals(
    points: FloatArray,
    deviations: FloatArray,
    body: Cylinder,
    parameters: CylinderFitParameters = CylinderFitParameters(),
) -> FloatArray:
    """How far `points` (n, 3) m lie behind the body on their rays, in their `deviations` (n,) m; (n,)."""
    limits = (parameters.min_facing, parameters.surface_noise)
    half = body.length / 2
    return cylinder.depth_residuals(points, deviations, body.center, body.axis, body.radius, half, *limits)
