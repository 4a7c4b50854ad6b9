"""Which end of a seen connector is the cable's, by how far the cable reaches."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from regrasp.interfaces.cable.sight import Estimate

if TYPE_CHECKING:
    from regrasp.interfaces.cable.cell import CableKnown

_HALF_TURN = np.diag([-1.0, -1.0, 1.0])  # about z: x leads the other way


def within_reach(estimate: Estimate, known: "CableKnown", error: float) -> Estimate:
    """The estimate with its tip at the end that the cable does not reach, where it reaches only one.

    The cable is fixed at its anchor and has a known length, so that the connector's end at the cable is no further than
    that from the anchor, and `error` m. Where both ends are in reach, or none, the estimate stays as it is.
    """
    anchor, _ = known.cable.anchor
    half = 0.5 * (known.cable.connector.length if estimate.whole else estimate.extent)
    ends = np.stack([estimate.position - half * estimate.axis, estimate.position + half * estimate.axis])
    here, there = np.linalg.norm(ends - anchor, axis=1) <= known.cable.length + error
    if here == there:
        return estimate
    if here:
        return replace(estimate, sign_seen=True)
    from scipy.spatial.transform import RigidTransform, Rotation

    pose = estimate.world_from_connector * RigidTransform.from_rotation(Rotation.from_matrix(_HALF_TURN))
    return replace(estimate, axis=-estimate.axis, world_from_connector=pose, sign_seen=True)
