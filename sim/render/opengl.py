"""The fast renderer: OpenGL without a window, on a graphics card or on Mesa's software rasteriser."""

from dataclasses import dataclass
from typing import Any

import cv2
import moderngl
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.frame import Intrinsics
from regrasp.sim.render.meshes import corners
from regrasp.sim.render.picture import BACKGROUND, FAR, NEAR, Image, LightState
from regrasp.sim.render.shaders import (
    BACKDROP_FRAGMENT,
    BACKDROP_VERTEX,
    FRAGMENT,
    SHADOW_FRAGMENT,
    SHADOW_VERTEX,
    VERTEX,
)
from regrasp.sim.render.visuals import Visuals

FloatArray = NDArray[np.float64]
SHADOW_SIZE = 1024  # texels a side of the shadow map
CASTER = 1.0  # metres: items of a larger radius (the floor) take shadows but throw none
_ROWS = ("row0", "row1", "row2")
INSTANCE = np.dtype([("pose", "f4", (3, 4)), ("color", "f4", 3), ("id", "i4")])


@dataclass(frozen=True)
class _Group:
    """Items that share a mesh: their rows, the mesh's radius about its origin, their records here and on the card."""

    rows: NDArray[np.int64]
    radius: float
    records: NDArray[np.void]
    buffer: Any
    draw: Any
    cast: Any


class GlRenderer:
    """Draws through moderngl over EGL. One thread owns it. Raises what moderngl raises if there is no EGL."""

    name = "moderngl"

    def __init__(self, visuals: Visuals, reason: str = "") -> None:
        backend: Any = {"backend": "egl"}
        self._gl: Any = moderngl.create_context(standalone=True, require=330, **backend)
        self.reason = f"{reason}: {self._gl.info['GL_RENDERER']}"
        self._gl.enable(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        self._gl.front_face = "cw"  # image rows run downwards, so the picture is GL's in a mirror
        self._gl.depth_func = "<="
        self._draw = self._gl.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
        self._cast = self._gl.program(vertex_shader=SHADOW_VERTEX, fragment_shader=SHADOW_FRAGMENT)
        behind = self._gl.program(vertex_shader=BACKDROP_VERTEX, fragment_shader=BACKDROP_FRAGMENT)
        _set(behind, color=BACKGROUND)
        self._backdrop = self._gl.vertex_array(behind, [])
        self._groups = self._make_groups(visuals)
        self._shadows = self._gl.depth_texture((SHADOW_SIZE, SHADOW_SIZE))
        self._shadows.compare_func = "<="
        self._shadows.repeat_x = self._shadows.repeat_y = False
        self._shadow_target = self._gl.framebuffer(depth_attachment=self._shadows)
        self._targets: dict[tuple[int, int], Any] = {}
        self._placed: tuple[NDArray[np.float32], LightState] | None = None

    def render(
        self, poses: NDArray[np.float32], world_from_camera: RigidTransform, intrinsics: Intrinsics, light: LightState
    ) -> Image:
        """See `Renderer.render`. The very same read-only poses, for a second camera, cost no second shadow pass."""
        placed = self._placed
        if placed is None or placed[0] is not poses or placed[1] is not light or poses.flags.writeable:
            self._place(poses, light)
            self._placed = (poses, light)
        target = self._target(intrinsics.width, intrinsics.height)
        target.use()
        target.clear()
        _write(self._draw, "world_to_clip", _clip_from_camera(intrinsics) @ world_from_camera.inv().as_matrix())
        self._shadows.use()
        for group in self._groups:
            group.draw.render(instances=len(group.rows))
        self._backdrop.render(vertices=3)
        return _read(target, intrinsics)

    def close(self) -> None:
        """Free the GL context."""
        self._gl.release()

    def _make_groups(self, visuals: Visuals) -> list[_Group]:
        """Small ones first: what lies behind them, mostly floor and panels, is then not shaded in vain."""
        rows: dict[tuple[Any, ...], list[int]] = {}
        for row, item in enumerate(visuals.items):
            rows.setdefault((item.kind, item.size, item.file), []).append(row)
        groups = [self._make_group(visuals, np.array(same)) for same in rows.values()]
        return sorted(groups, key=lambda group: group.radius)

    def _make_group(self, visuals: Visuals, rows: NDArray[np.int64]) -> _Group:
        vertices, index = np.unique(corners(visuals.items[rows[0]]), axis=0, return_inverse=True)
        records = np.zeros(len(rows), INSTANCE)
        records["color"] = [visuals.items[row].color for row in rows]
        records["id"] = visuals.ids[rows]
        mesh, order = self._gl.buffer(vertices.tobytes()), self._gl.buffer(index.astype("i4").tobytes())
        buffer = self._gl.buffer(records.tobytes())
        full = [(mesh, "3f 3f", "at", "normal"), (buffer, "4f 4f 4f 3f 1i/i", *_ROWS, "color", "item")]
        bare = [(mesh, "3f 12x", "at"), (buffer, "4f 4f 4f 16x/i", *_ROWS)]
        draw = self._gl.vertex_array(self._draw, full, index_buffer=order)
        cast = self._gl.vertex_array(self._cast, bare, index_buffer=order)
        return _Group(rows, float(np.linalg.norm(vertices[:, :3], axis=1).max()), records, buffer, draw, cast)

    def _place(self, poses: NDArray[np.float32], light: LightState) -> None:
        """Send the poses, and draw the shadow map."""
        for group in self._groups:
            group.records["pose"] = poses[group.rows]
            group.buffer.write(group.records.tobytes())
        casters = [group for group in self._groups if group.radius < CASTER]
        to_light = np.asarray(light.direction, float) / np.linalg.norm(light.direction)
        matrix, radius = _light_from_world(casters, poses, to_light)
        _write(self._cast, "world_to_light", matrix)
        _write(self._draw, "world_to_light", matrix)
        texel = 2 * radius / SHADOW_SIZE
        _set(self._draw, texel=texel, to_light=tuple(to_light), ambient=light.ambient, diffuse=light.diffuse)
        self._shadow_target.use()
        self._shadow_target.clear()
        for group in casters:
            group.cast.render(instances=len(group.rows))

    def _target(self, width: int, height: int) -> Any:
        """The frame buffer of that size: colour, depth, ids."""
        size = (width, height)
        if size not in self._targets:
            planes = [
                self._gl.texture(size, 4),
                self._gl.texture(size, 1, dtype="f4"),
                self._gl.texture(size, 1, dtype="i4"),
            ]
            self._targets[size] = self._gl.framebuffer(planes, self._gl.depth_renderbuffer(size))
        return self._targets[size]


def _set(program: Any, **uniforms: Any) -> None:
    for name, value in uniforms.items():
        program[name].value = value


def _write(program: Any, name: str, matrix: FloatArray) -> None:
    program[name].write(np.ascontiguousarray(matrix.T, "f4").tobytes())


def _clip_from_camera(k: Intrinsics) -> FloatArray:
    """Projection (4, 4) with image rows downwards: the centre of pixel u lies half a pixel into GL's column u."""
    return np.array(
        [
            [2 * k.fx / k.width, 0.0, (2 * k.cx + 1) / k.width - 1, 0.0],
            [0.0, 2 * k.fy / k.height, (2 * k.cy + 1) / k.height - 1, 0.0],
            [0.0, 0.0, (FAR + NEAR) / (FAR - NEAR), -2 * FAR * NEAR / (FAR - NEAR)],
            [0.0, 0.0, 1.0, 0.0],
        ]
    )


def _light_from_world(
    casters: list[_Group], poses: NDArray[np.float32], to_light: FloatArray
) -> tuple[FloatArray, float]:
    """Matrix (4, 4) that takes the casters' bounding ball to 0..1 as the light sees it, and the ball's radius (m).

    Its rows run downwards too, so that the same sides of triangles are drawn as in the picture.
    """
    low = np.min([poses[g.rows, :, 3].min(axis=0) - g.radius for g in casters], axis=0) if casters else -np.ones(3)
    high = np.max([poses[g.rows, :, 3].max(axis=0) + g.radius for g in casters], axis=0) if casters else np.ones(3)
    centre, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    side = np.cross(to_light, [1.0, 0.0, 0.0] if abs(to_light[0]) < 0.9 else [0.0, 1.0, 0.0])
    side /= np.linalg.norm(side)
    turn = np.array([side, np.cross(side, to_light), -to_light]) / (2 * radius)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, 0.5 - turn @ centre
    return matrix, radius


def _read(target: Any, k: Intrinsics) -> Image:
    depth, ids = np.empty((k.height, k.width), np.float32), np.empty((k.height, k.width), np.int32)
    rgba = np.empty((k.height, k.width, 4), np.uint8)
    target.read_into(rgba, components=4)
    target.read_into(depth, components=1, attachment=1, dtype="f4")
    target.read_into(ids, components=1, attachment=2, dtype="i4")
    return Image(cv2.cvtColor(rgba, cv2.COLOR_RGBA2RGB), depth, ids)
