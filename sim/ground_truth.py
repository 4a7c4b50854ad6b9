"""Ground truth of a world, for judges, studies and tests. The robot's software never reads it."""

import numpy as np
import pybullet as p
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.frame import Intrinsics
from regrasp.sim.render.visuals import segmentation_id
from regrasp.sim.world import World

_OUT_OF_VIEW = -100.0  # m, in all three coordinates


class GroundTruth:
    """Ground truth of one world."""

    def __init__(self, world: World) -> None:
        self._world = world

    def connector_pose(self) -> RigidTransform:
        """Pose world_from_connector."""
        return self._world.connector_pose()

    def connector_speed(self) -> float:
        """Speed of the connector's centre in m/s."""
        return float(np.linalg.norm(self._world.connector_velocity()))

    def held(self) -> bool:
        """Whether both pads of the right hand touch the connector."""
        return all(self._world.pads_touching("right"))

    def touched(self) -> bool:
        """Whether any pad of the right hand touches the connector."""
        return any(self._world.pads_touching("right"))

    def connector_in_hand(self) -> FloatArray:
        """The connector's centre (3,) m in the frame between the pads of the right hand."""
        return self._world.arms["right"].in_tool(self._world.connector_position())

    def plugged(self) -> bool:
        """Whether the connector sits in its socket."""
        return self._world.socket.holds

    def stowed(self) -> bool:
        """Whether the connector sits in the clip."""
        return self._world.clip.holds

    def seat_error(self) -> tuple[float, float]:
        """Error of the connector to its seat in the clip: distance of the centres (m), angle of the axes (degrees)."""
        error = self._world.cell.known.cable.clip.world_from_seat.inv() * self._world.connector_pose()
        cosine = error.rotation.as_matrix()[0, 0]
        return float(np.linalg.norm(error.translation)), float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))

    def connector_pixels(self, camera: str) -> int:
        """Number of the connector's pixels in the newest frame of that camera."""
        ids = self._world.cameras[camera].true_ids()
        return 0 if ids is None else self._count(ids)

    def occluded_share(self, camera: str, magnification: int = 8) -> float:
        """Share, 0 to 1, of the connector's pixels, without its tag, that obstacles now occlude in that camera.

        The pixels are those of a camera with `magnification` times the focal length, so that parts of a pixel count.
        Choice: with 8, an obstacle's edge is uncertain by a tenth of a percent of the connector.
        """
        world, seen_by = self._world, self._world.cameras[camera]
        target = seen_by.true_pose().inv().apply(world.connector_pose().translation)
        closer = _centred_on(target, seen_by.spec.intrinsics, magnification)
        items, end = world.visuals.items, (world.cable.body, world.cable.connector_link)
        with_all = world.visuals.snapshot().copy()
        with_all[[(i.body, i.link) == end and i.kind == p.GEOM_BOX for i in items], :, 3] = _OUT_OF_VIEW  # the tag
        without = with_all.copy()
        obstacles = [body for name, body in world.boxes.items() if name.startswith("obstacle ")]
        without[[item.body in obstacles for item in items], :, 3] = _OUT_OF_VIEW
        free, left = (self._count(seen_by.segmentation(poses, closer)) for poses in (without, with_all))
        return 1.0 - left / free

    def _count(self, ids: NDArray[np.int32]) -> int:
        cable = self._world.cable
        return int(np.count_nonzero(ids == segmentation_id(cable.body, cable.connector_link)))

    def contact_peaks(self) -> dict[str, float]:
        """Largest normal force in N, so far, between each arm and each body that it must not touch."""
        return dict(self._world.contact_peaks)


def _centred_on(center: FloatArray, camera: Intrinsics, magnification: int) -> Intrinsics:
    """Intrinsics with `magnification` times the focal length and the point `center` (3,) m in the picture's centre.

    `center` is in the optical frame.
    """
    fx, fy = magnification * camera.fx, magnification * camera.fy
    x, y, z = center.tolist()
    middle = (camera.width - 1) / 2, (camera.height - 1) / 2
    return Intrinsics(camera.width, camera.height, fx, fy, middle[0] - fx * x / z, middle[1] - fy * y / z)
