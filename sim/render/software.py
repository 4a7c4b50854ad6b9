"""The renderer without OpenGL: it draws what the OpenGL renderer draws, on one processor core."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import DTypeLike, NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.frame import Intrinsics
from regrasp.sim.render.meshes import shared_meshes
from regrasp.sim.render.picture import BACKGROUND, Z_FAR, Z_NEAR, Image, LightState, RendererName
from regrasp.sim.render.raster import draw_triangles, place_corners, project_corners
from regrasp.sim.render.shading import find_runs, read_out, shade, write_normals
from regrasp.sim.render.shadows import DEFAULT_SHADOWS, ShadowParameters, light_from_world, rows_and_radii
from regrasp.sim.render.visuals import Visuals

_LARGEST = 1e6  # m; what is farther from the origin is not drawn
_OFFSET = 1.5  # texels along the normal, at which shadows are looked up, as the OpenGL renderer does


@dataclass(frozen=True, eq=False)
class _Pixels:
    """What is worked out for the pixels of pictures (H, W) of one size, written anew for each.

    Attributes:
        inverse: Inverse depth (H, W), 1/m.
        seen: The triangle that each pixel sees (H, W), -1 for none.
        first_run: See `find_runs`.
        ends: See `find_runs`.
        channels: Red, green and blue (3, H, W).
    """

    inverse: NDArray[np.float32]
    seen: NDArray[np.int32]
    first_run: NDArray[np.int32]
    ends: NDArray[np.int32]
    channels: NDArray[np.uint8]


class SoftwareRenderer:
    """A `Renderer` of compiled loops: it finds the triangle that each pixel sees, then colours each pixel once."""

    name: RendererName = "software"
    device = "compiled loops on one core"

    def __init__(self, visuals: Visuals, shadow_parameters: ShadowParameters = DEFAULT_SHADOWS) -> None:
        self.visuals = visuals
        shared = shared_meshes(visuals)
        mesh_of = {int(row): mesh for mesh in shared for row in mesh.rows}
        meshes = [mesh_of[row] for row in range(len(visuals.items))]
        self._order = np.array([row for mesh in shared for row in mesh.rows], np.int64)  # small ones first
        self._radius = np.array([mesh.radius for mesh in meshes])
        casters = [mesh for mesh in shared if mesh.radius < shadow_parameters.largest_caster]
        self._casters, self._caster_radii = rows_and_radii(casters)
        self._first_corner = _starts([len(mesh.corners) for mesh in meshes])
        self._first_triangle = _starts([len(mesh.triangles) for mesh in meshes])
        self._local = _stack([mesh.corners for mesh in meshes], 6, np.float32)
        shifted = [mesh.triangles + start for mesh, start in zip(meshes, self._first_corner, strict=False)]
        self._triangles = _stack(shifted, 3, np.int32)
        self._item_of = np.repeat(np.arange(len(meshes)), [len(mesh.triangles) for mesh in meshes]).astype(np.int32)
        self._colors = 255 * _stack([np.array([item.color]) for item in visuals.items], 3, np.float32)
        self._places, self._normals = (np.empty((len(self._local), 3), np.float32) for _ in range(2))
        self._corners = np.empty((len(self._local), 6))
        self._planes = np.empty((len(self._triangles), 9), np.float32)
        self._ready = np.empty(len(self._triangles), bool)
        self._shadows = np.empty((shadow_parameters.size,) * 2, np.float32)
        self._texels_from_world: FloatArray = np.eye(4)
        self._pixels_by_size: dict[tuple[int, int], _Pixels] = {}
        self._placed: tuple[NDArray[np.float32], LightState] | None = None

    def render(
        self, poses: NDArray[np.float32], world_from_camera: RigidTransform, intrinsics: Intrinsics, light: LightState
    ) -> Image:
        """See `Renderer.render`. Where nothing has moved since the last picture, no shadows are drawn anew."""
        rgb = self.render_color(poses, world_from_camera, intrinsics, light)
        at = self._pixels(intrinsics)
        depth, ids = np.empty(at.seen.shape, np.float32), np.empty(at.seen.shape, np.int32)
        read_out(at.inverse, at.seen, at.first_run, at.ends, self._item_of, self.visuals.ids, depth, ids)
        return Image(rgb, depth, ids)

    def render_color(
        self, poses: NDArray[np.float32], world_from_camera: RigidTransform, intrinsics: Intrinsics, light: LightState
    ) -> NDArray[np.uint8]:
        """See `Renderer.render_color`."""
        if self._placed is None or self._placed[1] is not light or not np.array_equal(self._placed[0], poses):
            self._place(poses, light)
            self._placed = (poses.copy(), light)
        at = self._pixels(intrinsics)
        at.inverse.fill(1.0 / Z_FAR)
        at.seen.fill(-1)
        camera_from_world, pixels = world_from_camera.inv().as_matrix(), _pixels_from_camera(intrinsics)
        sound = self._order[_sound(poses[self._order])]
        centres = poses[sound, :, 3] @ camera_from_world[:3, :3].T + camera_from_world[:3, 3]
        visible = sound[_in_view(centres, self._radius[sound], intrinsics)]
        project_corners(self._places, visible, self._first_corner, pixels @ camera_from_world, self._corners)
        draw = (self._corners, visible, self._first_triangle, self._triangles)
        draw_triangles(*draw, Z_NEAR, at.inverse, at.seen)
        find_runs(at.seen, at.first_run, at.ends)
        runs = (at.seen, at.first_run, at.ends)
        write_normals(self._corners, self._triangles, self._normals, *runs, self._ready, self._planes)
        rays = world_from_camera.as_matrix() @ np.linalg.inv(pixels)
        shade(
            at.inverse,
            *runs,
            self._planes,
            self._item_of,
            self._colors,
            rays.astype(np.float32),
            (self._texels_from_world @ rays).astype(np.float32),
            self._shadows,
            (np.float32(light.ambient), np.float32(light.diffuse), np.float32(_OFFSET)),
            np.rint(255 * np.array(BACKGROUND)).astype(np.uint8),
            at.channels,
        )
        return np.asarray(cv2.merge(tuple(at.channels)), np.uint8)

    def close(self) -> None:
        """Nothing need be freed."""

    def _place(self, poses: NDArray[np.float32], light: LightState) -> None:
        """Move all corners and draw the shadow map: texels hold how near to the light its nearest surface is."""
        sound = _sound(poses[self._casters])
        rows = self._casters[sound]
        to_light = np.asarray(light.direction, float) / np.linalg.norm(light.direction)
        matrix, radius = light_from_world(poses[rows, :, 3], self._caster_radii[sound], to_light)
        turn = (2 * radius * matrix[:3, :3]).astype(np.float32)
        place_corners(self._local, self._order, self._first_corner, poses, turn, self._places, self._normals)
        size = len(self._shadows)
        texels = np.array([[size, 0, 0, -0.5], [0, size, 0, -0.5], [0, 0, -1, 1], [0, 0, 0, 1]])
        self._texels_from_world = texels @ matrix
        self._shadows.fill(0.0)
        view = self._texels_from_world[[0, 1, 3, 2]]
        project_corners(self._places, rows, self._first_corner, view, self._corners)
        draw_triangles(self._corners, rows, self._first_triangle, self._triangles, 0.0, self._shadows, None)

    def _pixels(self, k: Intrinsics) -> "_Pixels":
        size = (k.height, k.width)
        if size not in self._pixels_by_size:
            self._pixels_by_size[size] = _Pixels(
                inverse=np.empty(size, np.float32),
                seen=np.empty(size, np.int32),
                first_run=np.empty(k.height + 1, np.int32),
                ends=np.empty(k.height * k.width, np.int32),
                channels=np.empty((3, *size), np.uint8),
            )
        return self._pixels_by_size[size]


def _starts(lengths: list[int]) -> NDArray[np.int64]:
    return np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)


def _stack(rows: Sequence[NDArray[Any]], width: int, kind: DTypeLike) -> NDArray[Any]:
    return np.concatenate([np.empty((0, width)), *rows]).astype(kind)


def _pixels_from_camera(k: Intrinsics) -> FloatArray:
    """The matrix (4, 4) from a point to its pixel times its depth, its depth, and 1."""
    return np.array([[k.fx, 0.0, k.cx, 0.0], [0.0, k.fy, k.cy, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


def _sound(poses: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Which poses are of numbers that can be drawn; those of a world that has blown up are not."""
    return np.abs(poses).reshape(len(poses), 12).max(axis=1) < _LARGEST


def _in_view(centres: FloatArray, radius: FloatArray, k: Intrinsics) -> NDArray[np.bool_]:
    """Which spheres about `centres` (n, 3) in the camera's frame may show in the picture."""
    inwards = np.array(
        [
            [k.fx, 0, k.cx + 0.5],
            [-k.fx, 0, k.width - 0.5 - k.cx],
            [0, k.fy, k.cy + 0.5],
            [0, -k.fy, k.height - 0.5 - k.cy],
        ]
    )
    distance = centres @ (inwards / np.linalg.norm(inwards, axis=1, keepdims=True)).T
    return (distance > -radius[:, None]).all(axis=1) & (centres[:, 2] + radius > Z_NEAR)
