"""Take the found connector again."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.behaviors.cable.hand import HAND, HandLeaf
from regrasp.behaviors.leaf import Failed, Steps
from regrasp.motion.service import OPEN_GAP
from regrasp.perception.pose.cable_shape import cable_course

CLEAR = 0.05  # m around the connector's axis


class Regrasp(HandLeaf):
    """Brings the hand to where the connector was found, closes, feels.

    A hand that closes on nothing opens and goes back to sleep, and the leaf fails.
    """

    def steps(self) -> Steps:
        """See the class."""
        motion, connector = self.services.motion, self.services.belief.connector
        assert connector is not None
        occupancy = self.services.perception.occupancy
        points = occupancy.occupied_points()
        seen = {tuple(p) for p in occupancy.occupied_points(guessed=False).tolist()}
        half = 0.5 * self.services.known.connector.length
        # A guess near the connector, which was looked at, is no obstacle; a surface that was seen there is one.
        far = _distance_to_axis(points, connector, half) > CLEAR
        kept = far | np.array([tuple(p) in seen for p in points.tolist()], bool)
        motion.set_obstacles(points[kept], occupancy.voxel_size)
        yield motion.pick(HAND, connector, cable=cable_course(self.services.known, connector), seen=self.seen)
        try:
            yield from self.grip(connector)
        except Failed:
            motion.grippers[HAND].open(OPEN_GAP)
            yield from self.wait(0.6)
            yield from self.draw_back()
            yield from self.go_to_sleep(HAND)
            raise


def _distance_to_axis(points: NDArray[np.float64], connector: RigidTransform, half: float) -> NDArray[np.float64]:
    """Distances (n,) m of points (n, 3) from the connector's axis, `half` m to each side of its centre."""
    if not len(points):
        return np.empty(0)
    local = connector.inv().apply(points)
    local[:, 0] -= np.clip(local[:, 0], -half, half)
    return np.asarray(np.linalg.norm(local, axis=1))
