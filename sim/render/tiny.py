"""PyBullet's software renderer, for machines without EGL. It is ten times slower than OpenGL."""

import numpy as np
import pybullet as p
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.frame import Intrinsics
from regrasp.sim.render.meshes import triangle_corners
from regrasp.sim.render.picture import BACKGROUND, Z_FAR, Z_NEAR, Image, LightState
from regrasp.sim.render.visuals import VisualItem, Visuals


class TinyRenderer:
    """A `Renderer` with its own PyBullet client, in which one visual body for each item is moved to the given poses."""

    name = "tiny"

    def __init__(self, visuals: Visuals, reason: str = "") -> None:
        self.visuals, self.reason = visuals, reason
        self._client = p.connect(p.DIRECT)
        self._bodies = [_body(self._client, item) for item in visuals.items]
        # Item ids by body number + 1; the first is for no body, -1.
        self._ids = np.full(max(self._bodies, default=0) + 2, -1, np.int32)
        self._ids[np.array(self._bodies, int) + 1] = visuals.ids

    def render(
        self, poses: NDArray[np.float32], world_from_camera: RigidTransform, intrinsics: Intrinsics, light: LightState
    ) -> Image:
        """See `Renderer.render`."""
        turns = Rotation.from_matrix(poses[:, :, :3]).as_quat() if len(poses) else np.zeros((0, 4))
        for body, pose, turn in zip(self._bodies, poses.astype(float), turns, strict=True):
            p.resetBasePositionAndOrientation(body, pose[:, 3].tolist(), turn.tolist(), physicsClientId=self._client)
        k = intrinsics
        _, _, rgba, depth, seen = p.getCameraImage(
            k.width,
            k.height,
            viewMatrix=_view(world_from_camera),
            projectionMatrix=_projection(k),
            lightDirection=np.asarray(light.direction, float).tolist(),
            lightColor=[1.0, 1.0, 1.0],
            lightDistance=10.0,
            lightAmbientCoeff=light.ambient,
            lightDiffuseCoeff=light.diffuse,
            lightSpecularCoeff=0.0,
            shadow=1,
            renderer=p.ER_TINY_RENDERER,
            physicsClientId=self._client,
        )
        ids = self._ids[np.asarray(seen).reshape(k.height, k.width) + 1]
        buffer = np.asarray(depth, float).reshape(k.height, k.width)
        metres = np.where(ids == -1, 0.0, Z_FAR * Z_NEAR / (Z_FAR - (Z_FAR - Z_NEAR) * buffer)).astype(np.float32)
        rgb = np.ascontiguousarray(np.asarray(rgba, np.uint8).reshape(k.height, k.width, 4)[:, :, :3])
        rgb[ids == -1] = np.rint(255 * np.array(BACKGROUND)).astype(np.uint8)
        return Image(rgb, metres, ids)

    def render_color(
        self, poses: NDArray[np.float32], world_from_camera: RigidTransform, intrinsics: Intrinsics, light: LightState
    ) -> NDArray[np.uint8]:
        """See `Renderer.render_color`."""
        return self.render(poses, world_from_camera, intrinsics, light).rgb

    def close(self) -> None:
        """Disconnect the PyBullet client."""
        p.disconnect(physicsClientId=self._client)


def _body(client: int, item: VisualItem) -> int:
    rows = triangle_corners(item)
    shape = p.createVisualShape(
        p.GEOM_MESH,
        vertices=rows[:, :3].tolist(),
        normals=rows[:, 3:].tolist(),
        indices=list(range(len(rows))),
        uvs=[[0.0, 0.0]] * len(rows),
        rgbaColor=[*item.color, 1.0],
        physicsClientId=client,
    )
    return int(p.createMultiBody(0, -1, shape, physicsClientId=client))


def _view(world_from_camera: RigidTransform) -> list[float]:
    """OpenGL's view matrix (y up, z backwards), column by column."""
    flip = np.diag([1.0, -1.0, -1.0, 1.0])
    return list((flip @ world_from_camera.inv().as_matrix()).T.ravel())


def _projection(k: Intrinsics) -> list[float]:
    """OpenGL's projection matrix, column by column; TinyRenderer samples a pixel at its lower left corner."""
    return [
        *(2 * k.fx / k.width, 0.0, 0.0, 0.0),
        *(0.0, 2 * k.fy / k.height, 0.0, 0.0),
        *(
            1 - 2 * k.cx / k.width,
            2 * (k.cy + 1) / k.height - 1,
            -(Z_FAR + Z_NEAR) / (Z_FAR - Z_NEAR),
            -1.0,
        ),
        *(0.0, 0.0, -2 * Z_FAR * Z_NEAR / (Z_FAR - Z_NEAR), 0.0),
    ]
