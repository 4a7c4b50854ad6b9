"""Fits the cylinder from many starts, since its cost has several minima: the axis may be tilted either way in depth."""

from dataclasses import dataclass, replace

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import Connector
from regrasp.perception.pose.fused.blob import Blob
from regrasp.perception.pose.fused.cylinder_fit import (
    Cylinder,
    CylinderFit,
    CylinderFitParameters,
    Observation,
    fit_cylinder,
    thinned,
)
from regrasp.perception.pose.fused.missing_axis import MissingAxisParameters, missing_share


@dataclass(frozen=True)
class MultiStartParameters:
    """The starts, how many of them are followed, and how fits are compared."""

    min_elongation: float = 2.0  # choice: a blob so many times longer than wide shows the axis' direction in the image
    # rad, of the starts' axes out of the image; the steep ones since noise tilts the fit to a short blob
    tilts: tuple[float, ...] = tuple(np.deg2rad([-80.0, -65.0, -40.0, 0.0, 40.0, 65.0, 80.0]).tolist())
    # rad, of the starts' axes in the image, where the blob does not show the direction
    image_angles: tuple[float, ...] = tuple(np.deg2rad([0.0, 45.0, 90.0, 135.0]).tolist())
    rough_points: int = 50  # points, and silhouette points, of rough fits
    rough_steps: int = 6  # of a rough fit
    rough_fits: int = 10  # starts that are fitted roughly
    full_fits: int = 4  # rough fits that are fitted in full
    same_distance: float = 0.02  # m; fits whose centres and axes are nearer than this end alike
    same_cosine: float = 0.94  # of 20 degrees, between their axes
    coarse_scale: float = 12.0  # deviations; choice: scale of the Cauchy loss on the way to the minimum
    fine_scale: float = 2.0  # deviations; choice: likewise in the last fit, where outliers must count little
    missing_cost: float = 100.0  # of a whole axis that should show: what is missing weighs like twenty outliers
    max_cost_ratio: float = 4.0  # choice: a fit so many times worse than the best is no doubt, and not worth more steps
    doubt_cost: float = 3.0  # of cost that makes another fit e times less likely; 1 for noise without outliers


def fit_from_starts(
    blob: Blob,
    connector: Connector,
    parameters: MultiStartParameters,
    fit_parameters: CylinderFitParameters,
    missing_parameters: MissingAxisParameters,
) -> list[CylinderFit]:
    """The best fits of all starts, best first: a few steps from each promising start, then in full from the best."""

    def score(found: CylinderFit) -> float:
        """The lower the better."""
        return found.cost + parameters.missing_cost * missing_share(blob, found, missing_parameters)

    few, all_of_it = thinned(blob.observation, parameters.rough_points), blob.observation
    coarse, fine = parameters.coarse_scale, parameters.fine_scale
    # No steps: this only gives each start its cost.
    starts = [fit_cylinder(few, s, coarse, fit_parameters, 0) for s in _starts(all_of_it, connector, parameters)]
    starts.sort(key=lambda f: f.cost)
    followed = _distinct(starts, parameters.rough_fits, parameters)
    rough = [fit_cylinder(few, f, coarse, fit_parameters, parameters.rough_steps) for f in followed]
    rough.sort(key=score)
    best = _distinct(rough, parameters.full_fits, parameters)
    full = [fit_cylinder(all_of_it, f, coarse, fit_parameters) for f in best]
    full.sort(key=score)
    worst = parameters.max_cost_ratio * (score(full[0]) + parameters.doubt_cost)
    return [fit_cylinder(all_of_it, f, fine, fit_parameters) for f in full if score(f) < worst]


def with_doubt(best: CylinderFit, others: list[CylinderFit], doubt_cost: float) -> CylinderFit:
    r"""The best fit, its covariance widened by the other fits that explain the blob nearly as well.

    With the difference :math:`x_j` (5,) of each other fit and the `doubt_cost` :math:`D`:

    .. math:: \Sigma + \sum_j e^{\min(0, (C - C_j) / D)} x_j x_j^T
    """
    covariance = best.covariance.copy()
    for other in others:
        doubt = float(np.exp(min(0.0, (best.cost - other.cost) / doubt_cost)))
        rotation = np.cross(best.axis, other.axis * (1.0 if best.axis @ other.axis >= 0 else -1.0))
        apart = np.concatenate([other.center - best.center, best.tilt_axes @ rotation])
        covariance += doubt * np.outer(apart, apart)
    return replace(best, covariance=covariance)


def _distinct(fits: list[CylinderFit], count: int, parameters: MultiStartParameters) -> list[CylinderFit]:
    """The first `count` of them that are not nearly the same."""

    def same(a: CylinderFit, b: CylinderFit) -> bool:
        near = float(np.linalg.norm(a.center - b.center)) < parameters.same_distance
        return near and bool(abs(a.axis @ b.axis) > parameters.same_cosine)

    kept: list[CylinderFit] = []
    for f in fits:
        if not any(same(f, k) for k in kept):
            kept.append(f)
        if len(kept) == count:
            break
    return kept


def _starts(observation: Observation, connector: Connector, parameters: MultiStartParameters) -> list[Cylinder]:
    """Cylinders to start a fit from: along the blob, tilted in depth, and with either end at the blob's end."""
    middle = np.median(observation.points, axis=0)
    view = middle / np.linalg.norm(middle)
    offsets = observation.points - middle
    starts = []
    axes = _start_axes(offsets, view, parameters)
    ends = np.percentile(offsets @ np.array(axes).T, [2, 98], axis=0).T
    for axis, (low, high) in zip(axes, ends, strict=True):
        # The points lie on the front; their mean is pi / 4 of the radius before the axis.
        behind = middle + np.pi / 4 * connector.radius * (view - (view @ axis) * axis)
        shifts = (low + connector.length / 2, high - connector.length / 2)
        starts += [Cylinder(behind + shift * axis, axis, connector.radius, connector.length) for shift in shifts]
    return starts


def _start_axes(offsets: FloatArray, view: FloatArray, parameters: MultiStartParameters) -> list[FloatArray]:
    """Unit axes (3,): the points' principal axis, and tilted ones. `offsets` (n, 3) m of the points, `view` (3,)."""
    flat = offsets - np.outer(offsets @ view, view)
    values, vectors = np.linalg.eigh(flat.T @ flat)
    elongated = values[-1] > parameters.min_elongation**2 * values[-2]
    angles = (0.0,) if elongated else parameters.image_angles
    directions = [np.cos(angle) * vectors[:, -1] + np.sin(angle) * vectors[:, -2] for angle in angles]
    principal = np.linalg.eigh(offsets.T @ offsets)[1][:, -1]
    tilted = [np.cos(tilt) * way + np.sin(tilt) * view for way in directions for tilt in parameters.tilts]
    return [principal, *tilted]
