"""Is a fitted cylinder the connector? What does not fit is refused; so is what shows too little to tell."""

from dataclasses import dataclass

import cv2
import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.perception.pose.cable_end import CableEndParameters, cable_leaves
from regrasp.perception.pose.fused.blob import Blob, rays_through
from regrasp.perception.pose.fused.cylinder_fit import (
    Cylinder,
    CylinderFitParameters,
    closest_approaches,
    depth_residuals,
)
from regrasp.perception.pose.fused.missing_axis import MissingAxisParameters, missing_share


@dataclass(frozen=True)
class PlausibilityParameters:
    """Limits of a plausible fit. Of 140 renders in all poses, up to 70 % hidden, 139 stay within all of them."""

    max_silhouette_residual: float = 0.5  # px, median over the silhouette
    max_stray_share: float = 0.3  # of the silhouette, more than a pixel off: a cable in front causes this much
    max_median_depth_residual: float = 1.2  # deviations, median of the depth residuals
    max_depth_residual_p80: float = 2.2  # deviations, 80th percentile of the depth residuals
    # rad; choice: a cylinder seen so nearly along its axis shows a disc, as a ball does
    max_head_on_angle: float = float(np.deg2rad(4.0))
    # Search radius (px). Same-coloured pixels in it that the fitted cylinder does not explain mean that the blob
    # belongs to a larger object.
    beside_radius: int = 10
    max_beside_share: float = 0.25  # of those pixels, in the blob's area
    max_missing_share: float = 0.15  # of the axis that should show and does not; a shorter rod of 7 cm lacks a tenth
    end_distance: float = 0.004  # m; silhouette points so near to an end belong to it
    min_end_points: int = 4  # silhouette points that show that the end is in sight
    min_side_points: int = 3  # silhouette points on either side of the axis that show how thick the body is
    # Radii, of the visible length. Connectors that are 70 % hidden show 19 mm, fragments of other objects 17 mm.
    min_length_radii: float = 1.8


def refusal(
    blob: Blob,
    body: Cylinder,
    parameters: PlausibilityParameters,
    fit_parameters: CylinderFitParameters,
    missing_parameters: MissingAxisParameters,
) -> str | None:
    """Why the blob is not the connector, in a sentence; None when it may be."""
    seen = blob.observation
    pixels = np.abs(_pixels_off(blob, seen.rays, body, fit_parameters))[~seen.occluded]
    edge, stray = float(np.median(pixels)), float(np.mean(pixels > 1.0))
    if edge > parameters.max_silhouette_residual or stray > parameters.max_stray_share:
        return f"its silhouette is {edge:.1f} pixels off the connector's, {stray:.0%} of it more than one"
    residuals = np.abs(depth_residuals(seen.points, seen.point_deviations, body, fit_parameters))
    median, high = float(np.median(residuals)), float(np.percentile(residuals, 80))
    if median > parameters.max_median_depth_residual or high > parameters.max_depth_residual_p80:
        return f"its surface is {median:.1f} deviations off the connector's, a fifth of it more than {high:.1f}"
    head_on = np.cos(parameters.max_head_on_angle)
    if abs(float(body.axis @ body.center)) > head_on * float(np.linalg.norm(body.center)):
        return "nothing but a disc shows, which may be an end or a ball"
    beside = _pixels_beside(blob, body, parameters.beside_radius, fit_parameters)
    if beside > parameters.max_beside_share * blob.area:
        return f"{beside} more pixels of its colour lie beside it"
    missing = missing_share(blob, body, missing_parameters)
    if missing > parameters.max_missing_share:
        return (
            f"{missing:.0%} of its length should show and does not, at most {parameters.max_missing_share:.0%} may be"
        )
    return None


def too_little(
    blob: Blob,
    body: Cylinder,
    parameters: PlausibilityParameters,
    fit_parameters: CylinderFitParameters,
) -> str | None:
    """Why what shows of the body, but for its cable, may be a bit of anything; None where it is enough."""
    if blob.found.touches_border:
        return "it goes on beyond the picture"
    if not _both_sides(blob, body, parameters, fit_parameters):
        return "only one side of it"
    shown, least = visible_extent(blob, body), parameters.min_length_radii * body.radius
    return f"{1e3 * shown:.0f} mm of its length, {1e3 * least:.0f} are needed" if shown < least else None


def visible_ends(
    blob: Blob,
    body: Cylinder,
    parameters: PlausibilityParameters,
    fit_parameters: CylinderFitParameters,
    cable_parameters: CableEndParameters,
) -> tuple[bool, list[bool | None]]:
    """Whether an end is in sight, so that the length gives the centre; and whether the cable leaves either end.

    Order: the end at minus the axis, then the end at plus the axis. None: the frame does not tell; see `cable_leaves`.
    """
    along = _from_center(blob, body, fit_parameters) @ body.axis
    seen, leaves = [], []
    for side in (-1.0, 1.0):
        near = np.abs(side * along - body.length / 2) < parameters.end_distance
        seen.append(int(np.count_nonzero(near)) >= parameters.min_end_points)
        end, outward = body.center + side * body.length / 2 * body.axis, side * body.axis
        cable = (blob.depth, end, outward, blob.intrinsics, cable_parameters)
        leaves.append(cable_leaves(*cable) if seen[-1] else None)
    return any(seen), leaves


def visible_extent(blob: Blob, body: Cylinder) -> float:
    """Length (m) of the visible part, along the axis."""
    return float(np.ptp(np.percentile((blob.observation.points - body.center) @ body.axis, [1, 99])))


def _both_sides(
    blob: Blob, body: Cylinder, parameters: PlausibilityParameters, fit_parameters: CylinderFitParameters
) -> bool:
    """Whether the silhouette shows on either side of the axis, between the ends: how thick the body is."""
    from_center = _from_center(blob, body, fit_parameters)
    between = np.abs(from_center @ body.axis) < body.length / 2 - parameters.end_distance
    aside = from_center[between] @ np.cross(body.axis, body.center)
    return bool(min(np.count_nonzero(aside > 0), np.count_nonzero(aside < 0)) >= parameters.min_side_points)


def _from_center(blob: Blob, body: Cylinder, fit_parameters: CylinderFitParameters) -> FloatArray:
    """From the body's centre to where the rays of the silhouette in sight pass nearest to the body; (n, 3) m."""
    rays = blob.observation.rays[~blob.observation.occluded]
    _, ranges = closest_approaches(rays, body, fit_parameters)
    return np.asarray(ranges[:, None] * rays - body.center)


def _pixels_beside(blob: Blob, body: Cylinder, radius: int, fit_parameters: CylinderFitParameters) -> int:
    """Pixels of the colour within `radius` px of the blob that the fitted body does not explain."""
    kernel = np.ones((2 * radius + 1, 2 * radius + 1), np.uint8)
    v, u = np.nonzero(blob.found.others & (cv2.dilate(blob.found.mask.astype(np.uint8), kernel) > 0))
    if not len(u):
        return 0
    rays = rays_through(np.column_stack([u, v]), blob.intrinsics)
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    return int(np.count_nonzero(_pixels_off(blob, rays, body, fit_parameters) > 1.0))


def _pixels_off(blob: Blob, rays: FloatArray, body: Cylinder, fit_parameters: CylinderFitParameters) -> FloatArray:
    """How many pixels unit `rays` (n, 3) pass beside the body's silhouette, below 0 inside it; (n,)."""
    distances, ranges = closest_approaches(rays, body, fit_parameters)
    return np.asarray(distances / ranges * blob.intrinsics.fx)
