"""The natural shapes of a cable as transforms."""

from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.motion.cable.cable_path import CablePathParameters, natural_paths, natural_poses


def natural_pose(known: CableKnown, deflection: np.ndarray) -> RigidTransform:
    """world_from_connector of a cable bent by `deflection` (3,) m."""
    return RigidTransform.from_matrix(natural_poses(known, deflection[None])[0])


def natural_ways(known: CableKnown, start: RigidTransform, goal: RigidTransform) -> Iterator[list[RigidTransform]]:
    """Paths from start to goal, as in `natural_paths`, of a cable that counts as long as it is."""
    for path in natural_paths(known, start.as_matrix(), goal.as_matrix(), CablePathParameters(reserve=0.0)):
        yield list(RigidTransform.from_matrix(path))
