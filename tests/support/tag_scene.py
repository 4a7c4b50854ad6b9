"""Renders of a connector with a tag before a wall, by our own renderers, in the rear camera of the thesis's cell."""

from collections.abc import Sequence

import numpy as np
import pybullet as p
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.app.tasks.cable.cells import cable_cell
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.tag import Tag
from regrasp.sim.cameras.depth_noise import DepthNoise
from regrasp.sim.render.fiducials import compound_visual, tag_boxes
from regrasp.sim.render.renderer import LightState, RendererName, make_renderer
from regrasp.sim.render.visuals import Visuals

CELL = cable_cell("thesis_tags")
KNOWN, CONNECTOR, CAMERA = CELL.known, CELL.known.cable.connector, CELL.known.camera("rear")
K = CAMERA.intrinsics
assert CONNECTOR.tag is not None
TAG = CONNECTOR.tag
EYE = RigidTransform.identity()  # the camera's optical frame is the world
WALL = 1.1  # m before the camera


class TagScene:
    """A client with the wall and tagged connectors, one for each of `tags`."""

    def __init__(self, renderer: RendererName = "software", tags: Sequence[Tag] = (TAG,)) -> None:
        self._client = p.connect(p.DIRECT)
        wall = p.createVisualShape(
            p.GEOM_BOX, halfExtents=[3, 3, 0.01], rgbaColor=[0.8, 0.66, 0.45, 1], physicsClientId=self._client
        )
        p.createMultiBody(0, -1, wall, [0, 0, WALL + 0.01], physicsClientId=self._client)
        body = (CONNECTOR.radius, CONNECTOR.length, CONNECTOR.color)
        shapes = [compound_visual(self._client, tag_boxes(tag), tag.body_from_tag, body) for tag in tags]
        self._bodies = [p.createMultiBody(0, -1, shape, physicsClientId=self._client) for shape in shapes]
        self._visuals = Visuals(self._client)
        self._renderer = make_renderer(self._visuals, renderer)
        self._noise = DepthNoise(CAMERA, CELL.hidden.errors, 0)

    def frame(
        self, *poses: RigidTransform, number: int = 1, to_light: Sequence[float] = (-0.4, -0.5, -1.0)
    ) -> RgbdFrame:
        """The rear camera's frame of the connectors at `poses` (camera_from_connector); `number` keys its noise."""
        for body, pose in zip(self._bodies, poses, strict=True):
            place, turn = pose.translation.tolist(), pose.rotation.as_quat().tolist()
            p.resetBasePositionAndOrientation(body, place, turn, physicsClientId=self._client)
        image = self._renderer.render(self._visuals.snapshot(), EYE, K, LightState(np.array(to_light), 0.45, 0.55))
        return RgbdFrame("rear", number, 0.0, image.rgb, self._noise.apply(image.depth, number), K)

    def close(self) -> None:
        self._renderer.close()
        p.disconnect(self._client)


def facing(position: NDArray[np.float64], slant: float, towards: float, roll: float, tag: Tag = TAG) -> RigidTransform:
    """camera_from_connector with the tag's centre at `position` (3,) m, its face `slant` rad off the camera.

    `towards` rad says to which side it leans, `roll` rad how it is turned in its own plane.
    """
    back = -position / np.linalg.norm(position)
    side = np.cross(back, [np.cos(towards), np.sin(towards), 0.0])
    normal = Rotation.from_rotvec(slant * side / np.linalg.norm(side)).apply(back)
    x = np.cross([0.0, 1.0, 0.0], normal)
    x /= np.linalg.norm(x)
    turn = Rotation.from_matrix(np.column_stack([x, np.cross(normal, x), normal])) * Rotation.from_euler("z", roll)
    return RigidTransform.from_components(position, turn) * tag.body_from_tag.inv()


def random_pose(
    rng: np.random.Generator, distance: float = 0.75, most_slant_deg: float = 60.0
) -> tuple[RigidTransform, float]:
    """A pose whose tag is in the picture, and its slant in degrees; slants are even up to the most."""
    position = np.array([rng.uniform(-0.3, 0.3), rng.uniform(-0.15, 0.15), 1.0]) * distance
    slant = rng.uniform(0.0, np.deg2rad(most_slant_deg))
    return facing(position, slant, *rng.uniform(-np.pi, np.pi, 2)), float(np.rad2deg(slant))
