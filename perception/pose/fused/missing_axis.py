"""How much of a fitted cylinder's axis should show in the image and does not."""

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.arrays import FloatArray, Mask
from regrasp.perception.camera.model import NEAREST_DEPTH
from regrasp.perception.pose.fused.blob import Blob
from regrasp.perception.pose.fused.cylinder_fit import Cylinder


@dataclass(frozen=True)
class MissingAxisParameters:
    """Where the axis is sampled, and what counts as an occluder."""

    samples: tuple[float, ...] = tuple(np.linspace(-0.45, 0.45, 19).tolist())  # of the length, from the centre
    # Of the radius. Choice: a reading less than this before the axis is no occluder. The body's own surface is a radius
    # before its axis; a cable that goes on from a shorter rod is thinner.
    occluder_share: float = 0.7


def missing_share(blob: Blob, body: Cylinder, parameters: MissingAxisParameters) -> float:
    """Share of the axis samples that show no pixel of the blob, though no occluder is before them; 0 to 1."""
    k, margin = blob.intrinsics, parameters.occluder_share * body.radius
    along = body.length * np.array(parameters.samples)
    image = (blob.depth, blob.found.mask, k.fx, k.fy, k.cx, k.cy)
    return _missing_share(*image, body.center, body.axis, along, margin, NEAREST_DEPTH)


@numba.njit(cache=True, error_model="numpy")
def _missing_share(
    depth: NDArray[np.float32],
    mask: Mask,
    fx: float,
    fy: float,
    cx: float,
    cy: float,
    center: FloatArray,
    axis: FloatArray,
    along: FloatArray,
    margin: float,
    min_depth: float,
) -> float:
    missing = 0
    for a in along:
        x, y, z = center[0] + a * axis[0], center[1] + a * axis[1], center[2] + a * axis[2]
        if z < min_depth:
            continue
        u, v = round(fx * x / z + cx), round(fy * y / z + cy)
        if not (0 <= u < mask.shape[1] and 0 <= v < mask.shape[0]):
            continue
        missing += not mask[v, u] and depth[v, u] > z - margin
    return missing / len(along)
