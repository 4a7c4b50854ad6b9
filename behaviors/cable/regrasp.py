"""Grasp the connector again where it was found."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from regrasp.behaviors.cable.hand import HANDLING_ARM, HandLeaf
from regrasp.behaviors.leaf import LeafFailed, LeafSteps
from regrasp.perception.cable.cable_shape import cable_course

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform


@dataclass(frozen=True)
class RegraspParameters:
    """What the hand may pass through, and how it leaves an empty grasp."""

    # m round the connector's axis; voxels in it that were never seen, only taken for occupied, do not count; choice
    clear_radius: float = 0.05
    open_time: float = 0.6  # s that the jaw has to open after an empty grasp; choice


class Regrasp(HandLeaf):
    """Brings the hand to where the connector was found, closes the jaw and tells by its gap whether it holds.

    A hand that closes on nothing opens and goes back to sleep, and the leaf fails.
    """

    parameters: ClassVar[RegraspParameters] = RegraspParameters()

    def steps(self) -> LeafSteps:
        """See the class."""
        motion, connector = self.services.motion, self.services.belief.connector
        assert connector is not None
        occupancy = self.services.perception.occupancy
        points = occupancy.occupied_points()
        seen = {tuple(p) for p in occupancy.occupied_points(guessed=False).tolist()}
        half = 0.5 * self.services.known.cable.connector.length
        # The connector was looked at, so a guess near it is no obstacle; a surface that was seen there is one.
        far = _distance_to_axis(points, connector, half) > self.parameters.clear_radius
        kept = far | np.array([tuple(p) in seen for p in points.tolist()], bool)
        motion.set_obstacles(points[kept], occupancy.voxel_size)
        cable = cable_course(self.services.known, connector)
        yield motion.pick(HANDLING_ARM, connector, cable=cable, point_cloud=self.rear_point_cloud)
        try:
            yield from self.grip(connector)
        except LeafFailed:
            self.open_jaw()
            yield from self.wait(self.parameters.open_time)
            yield from self.draw_back()
            yield from self.go_to_sleep(HANDLING_ARM)
            raise


def _distance_to_axis(points: NDArray[np.float64], connector: "RigidTransform", half: float) -> NDArray[np.float64]:
    """Distances (n,) m of points (n, 3) m to the connector's axis, a segment of `half` m to each side of its centre."""
    if not len(points):
        return np.empty(0)
    local = connector.inv().apply(points)
    local[:, 0] -= np.clip(local[:, 0], -half, half)
    return np.asarray(np.linalg.norm(local, axis=1))
