"""Ground truth of a world, for judges, studies and tests. The robot's software never reads it."""

from collections.abc import Callable
from typing import Generic

import numpy as np
import pybullet as p
from numpy.typing import NDArray

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.frame import Intrinsics
from regrasp.sim.objects import ObjectsT
from regrasp.sim.render.visuals import VisualItem, segmentation_id
from regrasp.sim.world import World

_OUT_OF_VIEW = -100.0  # m, in all three coordinates


class GroundTruth(Generic[ObjectsT]):
    """Ground truth of one world of any task. A task derives its own for its objects."""

    def __init__(self, world: World[ObjectsT]) -> None:
        self._world = world

    def contact_peaks(self) -> dict[str, float]:
        """Largest normal force in N, so far, between each arm and each body that it must not touch."""
        return dict(self._world.contact_peaks)

    def pixels(self, camera: str, body: int, link: int = -1) -> int:
        """Number of pixels of a body's link in the newest frame of that camera; 0 before the first."""
        ids = self._world.cameras[camera].true_ids()
        return 0 if ids is None else _count(ids, body, link)

    def occlusion(
        self,
        camera: str,
        body: int,
        link: int = -1,
        left_out: Callable[[VisualItem], bool] = lambda item: False,
        magnification: int = 8,
    ) -> float:
        """Share, 0 to 1, of the pixels of a body's link that obstacles now occlude in that camera.

        Items of the link that are `left_out` count as if they were not there. The pixels are those of a camera with
        `magnification` times the focal length, so that parts of a pixel count. Choice: with 8, an obstacle's edge is
        uncertain by a tenth of a percent of a thing 0.1 m long.

        Raises:
            ZeroDivisionError: that camera would not see the link without obstacles either.
        """
        world, seen_by = self._world, self._world.cameras[camera]
        target = seen_by.true_pose().inv().apply(_position(world.client, body, link))
        closer = _centred_on(target, seen_by.spec.intrinsics, magnification)
        items = world.visuals.items
        with_all = world.visuals.snapshot().copy()
        with_all[[(i.body, i.link) == (body, link) and left_out(i) for i in items], :, 3] = _OUT_OF_VIEW
        without = with_all.copy()
        obstacles = [fixed for name, fixed in world.fixed_bodies.items() if name.startswith("obstacle ")]
        without[[item.body in obstacles for item in items], :, 3] = _OUT_OF_VIEW
        free, left = (_count(seen_by.segmentation(poses, closer), body, link) for poses in (without, with_all))
        return 1.0 - left / free


def _count(ids: NDArray[np.int32], body: int, link: int) -> int:
    return int(np.count_nonzero(ids == segmentation_id(body, link)))


def _position(client: int, body: int, link: int) -> FloatArray:
    """Position (3,) m of a link's frame in the world; for the base, -1, of its inertial frame."""
    if link == -1:
        return np.array(p.getBasePositionAndOrientation(body, physicsClientId=client)[0])
    return np.array(p.getLinkState(body, link, computeForwardKinematics=1, physicsClientId=client)[4])


def _centred_on(center: FloatArray, camera: Intrinsics, magnification: int) -> Intrinsics:
    """Intrinsics with `magnification` times the focal length and the point `center` (3,) m in the picture's centre.

    `center` is in the optical frame.
    """
    fx, fy = magnification * camera.fx, magnification * camera.fy
    x, y, z = center.tolist()
    middle = (camera.width - 1) / 2, (camera.height - 1) / 2
    return Intrinsics(camera.width, camera.height, fx, fy, middle[0] - fx * x / z, middle[1] - fy * y / z)
