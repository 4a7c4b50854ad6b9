"""Ground truth of a world with a cable, for judges, studies and tests. The robot's software never reads it."""

import numpy as np
import pybullet as p
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.sim.cable.objects import CableObjects
from regrasp.sim.ground_truth import GroundTruth


class CableTruth(GroundTruth[CableObjects]):
    """Ground truth of one world with a cable. The hand is whichever arm holds the connector, else touches it."""

    @property
    def _objects(self) -> CableObjects:
        return self._world.objects

    def connector_pose(self) -> RigidTransform:
        """Pose world_from_connector."""
        return self._objects.connector_pose()

    def connector_speed(self) -> float:
        """Speed of the connector's centre in m/s."""
        return float(np.linalg.norm(self._objects.connector_velocity()))

    def held(self) -> bool:
        """Whether both pads of the hand touch the connector."""
        return all(self._objects.touching()[1])

    def touched(self) -> bool:
        """Whether any pad of the hand touches the connector."""
        return any(self._objects.touching()[1])

    def connector_in_hand(self) -> FloatArray:
        """The connector's centre (3,) m in the frame between the hand's pads."""
        return self._world.arms[self._objects.touching()[0]].in_tool(self._objects.connector_position())

    def plugged(self) -> bool:
        """Whether the connector sits in a socket, or still on its stand."""
        return self._objects.plugged()

    def plugged_into(self) -> str | None:
        """Name of the socket in which the connector sits; None if it sits in none."""
        return self._objects.plugged_into()

    def stowed(self) -> bool:
        """Whether the connector sits in the clip."""
        return self._objects.clip.holds

    def seat_error(self) -> tuple[float, float]:
        """Error of the connector to its seat in the clip: distance of the centres (m), angle of the axes (degrees)."""
        error = self._objects.cell.known.cable.clip.world_from_seat.inv() * self._objects.connector_pose()
        cosine = error.rotation.as_matrix()[0, 0]
        return float(np.linalg.norm(error.translation)), float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))

    def connector_pixels(self, camera: str) -> int:
        """Number of the connector's pixels in the newest frame of that camera."""
        cable = self._objects.cable
        return self.pixels(camera, cable.body, cable.connector_link)

    def occluded_share(self, camera: str) -> float:
        """Share, 0 to 1, of the connector's pixels, without its tag, that obstacles now occlude in that camera."""
        cable = self._objects.cable
        return self.occlusion(camera, cable.body, cable.connector_link, lambda item: item.kind == p.GEOM_BOX)
