"""What the bodies of a PyBullet client look like, and where each part is now."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pybullet as p
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation


@dataclass(frozen=True)
class VisualItem:
    """One visual shape.

    `kind` is a PyBullet GEOM_ constant. `size` in metres: box: full edges; sphere: (radius, -, -); capsule and
    cylinder, along z: (length, radius, -); mesh: the scale of the file's units. `file` is the mesh file, else ''.
    `color` is RGB, 0 to 1.
    """

    body: int
    link: int
    kind: int
    size: tuple[float, float, float]
    file: str
    color: tuple[float, float, float]
    link_from_visual: RigidTransform

    @property
    def id(self) -> int:
        """Body and link as PyBullet packs them in its segmentation masks; -1 is the link of a base."""
        return self.body + ((self.link + 1) << 24)


class Visuals:
    """The visual shapes of all bodies that the client holds when this is made; fully transparent ones are left out."""

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
        self._local: NDArray[np.float64] = np.array(local).reshape(-1, 3, 4)

    def snapshot(self) -> NDArray[np.float32]:
        """World poses of all items now: (n, 3, 4), rows of world_from_visual. Read-only: cameras may share it."""
        frames = [frame for body, links in self._links.items() for frame in self._frames(body, links)]
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
        """Position and quaternion in the world of the links' URDF frames; for the base, -1, of its inertial frame."""
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
        if link == -1:  # a base's pose is that of its inertial frame, its visual frame is told in the URDF frame
            info = p.getDynamicsInfo(body, -1, physicsClientId=self._client)
            local = RigidTransform.from_components(info[3], Rotation.from_quat(info[4])).inv() * local
        return VisualItem(body, link, kind, tuple(size), file.decode(), tuple(color[:3]), local)
