"""The OpenGL renderer, without a window: on a graphics card or with Mesa's software rasteriser."""

from dataclasses import dataclass
from typing import Any

import cv2
import moderngl
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.frame import Intrinsics
from regrasp.sim.render.meshes import SharedMesh, shared_meshes
from regrasp.sim.render.picture import BACKGROUND, Z_FAR, Z_NEAR, Image, LightState, RendererName
from regrasp.sim.render.shaders import (
    BACKDROP_FRAGMENT,
    BACKDROP_VERTEX,
    FRAGMENT,
    SHADOW_FRAGMENT,
    SHADOW_VERTEX,
    VERTEX,
)
from regrasp.sim.render.shadows import DEFAULT_SHADOWS, ShadowParameters, light_from_world, rows_and_radii
from regrasp.sim.render.visuals import Visuals

_ROWS = ("row0", "row1", "row2")
_INSTANCE = np.dtype([("pose", "f4", (3, 4)), ("color", "f4", 3), ("id", "i4")])


@dataclass(frozen=True)
class _Group:
    """Items that share a mesh, and their records here and on the card."""

    mesh: SharedMesh
    records: NDArray[np.void]
    buffer: Any
    draw: Any
    cast: Any


class GlRenderer:
    """A `Renderer` that draws with moderngl over EGL, in the thread that made it.

    Raises whatever moderngl raises where no EGL context can be made.
    """

    name: RendererName = "moderngl"

    def __init__(self, visuals: Visuals, shadow_parameters: ShadowParameters = DEFAULT_SHADOWS) -> None:
        self.visuals, self._parameters = visuals, shadow_parameters
        backend: Any = {"backend": "egl"}
        self._gl: Any = moderngl.create_context(standalone=True, require=330, **backend)
        self.device = str(self._gl.info["GL_RENDERER"])
        self._gl.enable(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        self._gl.front_face = "cw"  # image rows run downwards, which mirrors GL's picture
        self._gl.depth_func = "<="
        self._draw = self._gl.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
        self._cast = self._gl.program(vertex_shader=SHADOW_VERTEX, fragment_shader=SHADOW_FRAGMENT)
        behind = self._gl.program(vertex_shader=BACKDROP_VERTEX, fragment_shader=BACKDROP_FRAGMENT)
        _set(behind, color=BACKGROUND)
        self._backdrop = self._gl.vertex_array(behind, [])
        # small ones first: floor and panels are then not shaded where something hides them
        self._groups = [self._make_group(mesh) for mesh in shared_meshes(visuals)]
        self._casting = [group for group in self._groups if group.mesh.radius < shadow_parameters.largest_caster]
        self._casters, self._caster_radii = rows_and_radii([group.mesh for group in self._casting])
        self._shadows = self._gl.depth_texture((shadow_parameters.size, shadow_parameters.size))
        self._shadows.compare_func = "<="
        self._shadows.repeat_x = self._shadows.repeat_y = False
        self._shadow_target = self._gl.framebuffer(depth_attachment=self._shadows)
        self._targets: dict[tuple[tuple[int, int], bool], Any] = {}  # by size, and whether for colour alone
        self._placed: tuple[NDArray[np.float32], LightState] | None = None

    def render(
        self, poses: NDArray[np.float32], world_from_camera: RigidTransform, intrinsics: Intrinsics, light: LightState
    ) -> Image:
        """See `Renderer.render`. Where nothing has moved since the last picture, no shadows are drawn anew."""
        target = self._target(intrinsics.width, intrinsics.height)
        self._draw_into(target, poses, world_from_camera, intrinsics, light)
        return _read(target, intrinsics)

    def render_color(
        self, poses: NDArray[np.float32], world_from_camera: RigidTransform, intrinsics: Intrinsics, light: LightState
    ) -> NDArray[np.uint8]:
        """See `Renderer.render_color`."""
        target = self._target(intrinsics.width, intrinsics.height, color_only=True)
        self._draw_into(target, poses, world_from_camera, intrinsics, light)
        return _read_color(target, intrinsics)

    def _draw_into(
        self,
        target: Any,
        poses: NDArray[np.float32],
        world_from_camera: RigidTransform,
        intrinsics: Intrinsics,
        light: LightState,
    ) -> None:
        if self._placed is None or self._placed[1] is not light or not np.array_equal(self._placed[0], poses):
            self._place(poses, light)
            self._placed = (poses.copy(), light)
        target.use()
        target.clear()
        _write(self._draw, "world_to_screen", _screen_from_camera(intrinsics) @ world_from_camera.inv().as_matrix())
        self._shadows.use()
        for group in self._groups:
            group.draw.render(instances=len(group.mesh.rows))
        self._backdrop.render(vertices=3)

    def close(self) -> None:
        """Free the GL context."""
        self._gl.release()

    def _make_group(self, mesh: SharedMesh) -> _Group:
        records = np.zeros(len(mesh.rows), _INSTANCE)
        records["color"] = [self.visuals.items[row].color for row in mesh.rows]
        records["id"] = self.visuals.ids[mesh.rows]
        corners, order = self._gl.buffer(mesh.corners.tobytes()), self._gl.buffer(mesh.triangles.tobytes())
        buffer = self._gl.buffer(records.tobytes())
        full = [(corners, "3f 3f", "at", "normal"), (buffer, "4f 4f 4f 3f 1i/i", *_ROWS, "color", "item")]
        bare = [(corners, "3f 12x", "at"), (buffer, "4f 4f 4f 16x/i", *_ROWS)]
        draw = self._gl.vertex_array(self._draw, full, index_buffer=order)
        cast = self._gl.vertex_array(self._cast, bare, index_buffer=order)
        return _Group(mesh, records, buffer, draw, cast)

    def _place(self, poses: NDArray[np.float32], light: LightState) -> None:
        """Send the poses to the card and draw the shadow map."""
        for group in self._groups:
            group.records["pose"] = poses[group.mesh.rows]
            group.buffer.write(group.records.tobytes())
        to_light = np.asarray(light.direction, float) / np.linalg.norm(light.direction)
        matrix, radius = light_from_world(poses[self._casters, :, 3], self._caster_radii, to_light)
        _write(self._cast, "world_to_light", matrix)
        _write(self._draw, "world_to_light", matrix)
        texel = 2 * radius / self._parameters.size
        _set(self._draw, texel=texel, to_light=tuple(to_light), ambient=light.ambient, diffuse=light.diffuse)
        self._shadow_target.use()
        self._shadow_target.clear()
        for group in self._casting:
            group.cast.render(instances=len(group.mesh.rows))

    def _target(self, width: int, height: int, color_only: bool = False) -> Any:
        """The frame buffer of that size, with planes for colour, depth and ids, or for colour alone."""
        size = (width, height)
        if (size, color_only) not in self._targets:
            planes = [self._gl.texture(size, 4)]
            if not color_only:
                planes += [self._gl.texture(size, 1, dtype="f4"), self._gl.texture(size, 1, dtype="i4")]
            self._targets[size, color_only] = self._gl.framebuffer(planes, self._gl.depth_renderbuffer(size))
        return self._targets[size, color_only]


def _set(program: Any, **uniforms: Any) -> None:
    for name, value in uniforms.items():
        program[name].value = value


def _write(program: Any, name: str, matrix: FloatArray) -> None:
    program[name].write(np.ascontiguousarray(matrix.T, "f4").tobytes())


def _screen_from_camera(k: Intrinsics) -> FloatArray:
    """OpenGL's projection matrix (4, 4) for intrinsics `k`, with image rows downwards.

    GL measures from a pixel's edge, `k` from its centre: the half pixel between them makes the 1 in the third column.
    """
    return np.array(
        [
            [2 * k.fx / k.width, 0.0, (2 * k.cx + 1) / k.width - 1, 0.0],
            [0.0, 2 * k.fy / k.height, (2 * k.cy + 1) / k.height - 1, 0.0],
            [
                0.0,
                0.0,
                (Z_FAR + Z_NEAR) / (Z_FAR - Z_NEAR),
                -2 * Z_FAR * Z_NEAR / (Z_FAR - Z_NEAR),
            ],
            [0.0, 0.0, 1.0, 0.0],
        ]
    )


def _read(target: Any, k: Intrinsics) -> Image:
    depth, ids = np.empty((k.height, k.width), np.float32), np.empty((k.height, k.width), np.int32)
    target.read_into(depth, components=1, attachment=1, dtype="f4")
    target.read_into(ids, components=1, attachment=2, dtype="i4")
    return Image(_read_color(target, k), depth, ids)


def _read_color(target: Any, k: Intrinsics) -> NDArray[np.uint8]:
    rgba = np.empty((k.height, k.width, 4), np.uint8)
    target.read_into(rgba, components=4)
    return np.asarray(cv2.cvtColor(rgba, cv2.COLOR_RGBA2RGB), np.uint8)
