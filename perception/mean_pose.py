"""One pose from several looks."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import RigidTransform

from interfaces.cell import pose_along
from perception.estimate import Estimate

LONG_SHARE = 0.9  # estimates that show less than this of the longest visible part do not count


def mean_pose(estimates: Sequence[Estimate]) -> tuple[RigidTransform, bool]:
    """world_from_connector: median position and mean axis of those that show most of it; and whether that is all of it.

    Raises ValueError without an estimate.
    """
    if not estimates:
        raise ValueError("no estimate to take the mean of")
    whole = [e for e in estimates if e.whole]
    counted = whole or list(estimates)
    longest = max(e.extent for e in counted)
    best = [e for e in counted if e.extent >= LONG_SHARE * longest]
    x, y, z = np.median([e.position for e in best], axis=0).tolist()
    ax, ay, az = np.mean([e.axis for e in best], axis=0).tolist()
    return pose_along((x, y, z), (ax, ay, az)), bool(whole)
