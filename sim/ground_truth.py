"""The truth of a world, for the judge of expectations, studies and tests. The robot's software never reads it."""

import numpy as np
import pybullet as p
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.frame import Intrinsics
from regrasp.sim.world import World

_LINK_SHIFT = 24
FINER = 8  # choice: the edge of an obstacle is then a tenth of a percent of the connector wide
FAR_OFF = -100.0  # m, out of every picture


class GroundTruth:
    """Reads one world."""

    def __init__(self, world: World) -> None:
        self._world = world

    def connector_pose(self) -> RigidTransform:
        """world_from_connector."""
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

    def connector_in_hand(self) -> NDArray[np.float64]:
        """The connector's centre (3,) m in the frame between the pads of the right hand."""
        center = self._world.connector_pose().translation
        return np.asarray(self._world.arms["right"].tool_pose().inv().apply(center))

    def plugged(self) -> bool:
        """Whether the connector sits in its socket."""
        return self._world.socket.holds

    def stowed(self) -> bool:
        """Whether the connector sits in the clip."""
        return self._world.clip.holds

    def seat_error(self) -> tuple[float, float]:
        """How far the connector is from its seat in the clip: m between the centres, degrees between the axes."""
        error = self._world.cell.known.clip.world_from_seat.inv() * self._world.connector_pose()
        cosine = error.rotation.as_matrix()[0, 0]
        return float(np.linalg.norm(error.translation)), float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))

    def connector_pixels(self, camera: str) -> int:
        """Pixels of the connector in a camera's newest frame."""
        ids = self._world.cameras[camera].true_ids()
        return 0 if ids is None else self._count(ids)

    def hidden_share(self, camera: str) -> float:
        """Share, 0 to 1, of what a camera would see of the connector, its tag aside, that the obstacles hide now.

        Counted in pixels `FINER` times as fine as the camera's, so that an edge between two of its pixels counts.
        """
        world, seen_by = self._world, self._world.cameras[camera]
        closer = _around(seen_by.true_pose().inv().apply(world.connector_pose().translation), seen_by.spec.intrinsics)
        items, end = world.visuals.items, (world.cable.body, world.cable.connector_link)
        with_all = world.visuals.snapshot().copy()
        with_all[[(i.body, i.link) == end and i.kind == p.GEOM_BOX for i in items], :, 3] = FAR_OFF  # a tag
        without = with_all.copy()
        obstacles = [body for name, body in world.boxes.items() if name.startswith("obstacle ")]
        without[[item.body in obstacles for item in items], :, 3] = FAR_OFF
        free, left = (self._count(seen_by.ids(poses, closer)) for poses in (without, with_all))
        return 1.0 - left / free

    def _count(self, ids: NDArray[np.int32]) -> int:
        cable = self._world.cable
        return int(np.count_nonzero(ids == cable.body + ((cable.connector_link + 1) << _LINK_SHIFT)))

    def contact_peaks(self) -> dict[str, float]:
        """Largest normal force in N between an arm and each thing that it must not touch, so far."""
        return dict(self._world.contact_peaks)


def _around(center: NDArray[np.float64], camera: Intrinsics) -> Intrinsics:
    """A camera with `FINER` times the focal length whose picture is centred on a point (3,) m of the optical frame."""
    fx, fy = FINER * camera.fx, FINER * camera.fy
    x, y, z = center.tolist()
    middle = (camera.width - 1) / 2, (camera.height - 1) / 2
    return Intrinsics(camera.width, camera.height, fx, fy, middle[0] - fx * x / z, middle[1] - fy * y / z)
