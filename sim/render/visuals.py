"""The visual shapes of the bodies in a PyBullet client, and their poses."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pybullet as p
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.fields import Color


@dataclass(frozen=True)
class VisualItem:
    """One visual shape.

    Attributes:
        body: PyBullet's number of its body.
        link: Its link, -1 for the base.
        kind: A PyBullet GEOM_ constant.
        size: In metres. Box: full edges; sphere: (radius, -, -); capsule and cylinder, which lie along z:
            (length, radius, -). Mesh: scale factors of the file's units.
        file: The mesh file, '' for other kinds.
        color: RGB, 0 to 1.
        link_from_visual: Pose of the shape in its link.
    """

    body: int
    link: int
    kind: int
    size: tuple[float, float, float]
    file: str
    color: Color
    link_from_visual: RigidTransform

    @property
    def id(self) -> int:
        """The item's `segmentation_id`; items of one link share it."""
        return segmentation_id(self.body, self.link)


def segmentation_id(body: int, link: int) -> int:
    """Body and link as PyBullet packs them in its segmentation masks; the base is link -1."""
    return body + ((link + 1) << 24)


class Visuals:
    """The visual shapes of all bodies in the client at construction, without fully transparent ones."""

    def __init__(self, client: int) -> None:
        self._client = client
        bodies = [p.getBodyUniqueId(i, physicsClientId=client) for i in range(p.getNumBodies(physicsClientId=client))]
        shapes = [s for b in bodies for s in p.getVisualShapeData(b, physicsClientId=client) if s[7][3] > 0]
        self.items = tuple(self._item(s) for s in shapes)
        self.ids: NDArray[np.int32] = np.array([item.id for item in self.items], np.int32)
        self._links = {b: sorted({i.link for i in self.items if i.body == b}) for b in bodies}
        rows = {key: row for row, key in enumerate((b, link) for b, links in self._links.items() for link in links)}
        self._rows = np.array([rows[i.body, i.link] for i in self.items], int)
        local = [i.link_from_visual.as_matrix()[:3] for i in self.items]
        self._local: FloatArray = np.array(local).reshape(-1, 3, 4)

    def snapshot(self) -> NDArray[np.float32]:
        """Present poses world_from_visual of all items, (n, 3, 4) float32. Read-only, so that cameras may share it."""
        return self.deferred_snapshot()()

    def deferred_snapshot(self) -> Callable[[], NDArray[np.float32]]:
        """What works out the present `snapshot` when it is first called, now or later."""
        frames = [frame for body, links in self._links.items() for frame in self._frames(body, links)]
        return cache(lambda: self._poses(frames))

    def _poses(self, frames: list[tuple[Any, Any]]) -> NDArray[np.float32]:
        if not frames:
            return np.zeros((0, 3, 4), np.float32)
        position, quaternion = zip(*frames, strict=True)
        turn = Rotation.from_quat(np.array(quaternion)).as_matrix()[self._rows]
        poses = np.empty((len(self.items), 3, 4), np.float32)
        poses[:, :, :3] = turn @ self._local[:, :, :3]
        poses[:, :, 3] = np.array(position)[self._rows] + (turn @ self._local[:, :, 3:])[:, :, 0]
        poses.flags.writeable = False
        return poses

    def _frames(self, body: int, links: list[int]) -> list[tuple[Any, Any]]:
        """Position and quaternion of the links' URDF frames in the world; for the base, -1, of its inertial frame."""
        frames = []
        if links and links[0] == -1:
            frames.append(p.getBasePositionAndOrientation(body, physicsClientId=self._client))
            links = links[1:]
        if links:
            states = p.getLinkStates(body, links, computeForwardKinematics=1, physicsClientId=self._client)
            frames += [(s[4], s[5]) for s in states]
        return frames

    def _item(self, shape: tuple[Any, ...]) -> VisualItem:
        body, link, kind, size, file, position, quaternion, color = shape[:8]
        local = RigidTransform.from_components(position, Rotation.from_quat(quaternion))
        if link == -1:  # PyBullet gives a base's pose for its inertial frame, but its visual frame in its URDF frame
            info = p.getDynamicsInfo(body, -1, physicsClientId=self._client)
            local = RigidTransform.from_components(info[3], Rotation.from_quat(info[4])).inv() * local
        return VisualItem(body, link, kind, tuple(size), file.decode(), tuple(color[:3]), local)
