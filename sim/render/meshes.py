"""Triangle meshes of visual shapes, for the renderers."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numba
import numpy as np
import pybullet as p
import trimesh
from numpy.typing import NDArray

from regrasp.interfaces.arrays import FloatArray
from regrasp.sim.render.visuals import VisualItem, Visuals


@dataclass(frozen=True)
class MeshParameters:
    """How fine the meshes are."""

    merge_cell: float = 0.002  # m; finer details of mesh files are merged: a pixel covers 1.4 mm at 0.9 m
    smooth_angle_deg: float = 40.0  # faces that meet at a smaller angle share a vertex normal
    thin_radius: float = 0.006  # m; a round shape below this radius ...
    thin_sides: int = 12  # ... has so many sides ...
    round_sides: int = 24  # ... and a thicker one so many


@dataclass(frozen=True)
class SharedMesh:
    """The mesh of some items.

    Attributes:
        rows: The items' numbers.
        corners: Positions (m) and unit normals, each once (n, 6), in the items' visual frame.
        triangles: Rows of `corners` (m, 3).
        radius: In m, about the origin of the visual frame.
    """

    rows: NDArray[np.int64]
    corners: NDArray[np.float32]
    triangles: NDArray[np.int32]
    radius: float


def shared_meshes(visuals: Visuals) -> list[SharedMesh]:
    """The meshes of all items, small ones first."""
    rows: dict[tuple[Any, ...], list[int]] = {}
    for row, item in enumerate(visuals.items):
        rows.setdefault((item.kind, item.size, item.file), []).append(row)
    return sorted((_shared(visuals, np.array(same)) for same in rows.values()), key=lambda mesh: mesh.radius)


def _shared(visuals: Visuals, rows: NDArray[np.int64]) -> SharedMesh:
    corners, index = np.unique(triangle_corners(visuals.items[rows[0]]), axis=0, return_inverse=True)
    radius = float(np.linalg.norm(corners[:, :3], axis=1).max())
    return SharedMesh(rows, corners, index.reshape(-1, 3).astype(np.int32), radius)


def triangle_corners(item: VisualItem, parameters: MeshParameters = MeshParameters()) -> NDArray[np.float32]:
    """Positions (m) and unit normals of the corners of n triangles, in the item's visual frame: (3 n, 6).

    Raises:
        ValueError: the item is of a PyBullet geometry that has no mesh here.
    """
    kind, size = item.kind, item.size
    if kind == p.GEOM_MESH:
        return _from_file(item.file, size, parameters)
    if kind == p.GEOM_BOX:
        box = trimesh.creation.box(size)
        return _rows(box.triangles, np.repeat(box.face_normals[:, None], 3, axis=1))
    if kind == p.GEOM_SPHERE:
        return _revolve(*_arc(size[0], 0.0, np.linspace(-90, 90, 13)), parameters)
    length, radius = size[0], size[1]
    if kind == p.GEOM_CYLINDER:
        side = np.array([[radius, -length / 2], [radius, length / 2]])
        profile = np.array([[0, -length / 2], side[0], side[0], side[1], side[1], [0, length / 2]])
        return _revolve(profile, np.array([[0, -1], [0, -1], [1, 0], [1, 0], [0, 1], [0, 1]], float), parameters)
    if kind == p.GEOM_CAPSULE:
        halves = [_arc(radius, h * length / 2, np.linspace(min(0, h * 90), max(0, h * 90), 4)) for h in (-1, 1)]
        return _revolve(np.vstack([o for o, _ in halves]), np.vstack([n for _, n in halves]), parameters)
    raise ValueError(f"body {item.body} link {item.link}: no way to draw PyBullet geometry {kind}")


def _arc(radius: float, height: float, angles_deg: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Profile (m, 2) in (r, z) of a circular arc about (0, height), and its normals (m, 2)."""
    angles = np.deg2rad(angles_deg)
    normals = np.column_stack([np.cos(angles), np.sin(angles)])
    return radius * normals + [0.0, height], normals


def _revolve(profile: FloatArray, normals: FloatArray, parameters: MeshParameters) -> NDArray[np.float32]:
    """Corners of the surface of revolution about z of a profile (m, 2) in (r, z), from bottom to top."""
    sides = parameters.thin_sides if profile[:, 0].max() < parameters.thin_radius else parameters.round_sides
    turns = np.arange(sides + 1) * (2 * np.pi / sides)
    # The circle lies between the polygon's inscribed and circumscribed circles, so that its mean width is right.
    profile = profile * [2 / (1 + np.cos(np.pi / sides)), 1.0]
    around = np.stack([np.cos(turns), np.sin(turns)], axis=-1)

    def ring(rz: FloatArray) -> FloatArray:
        flat = rz[:, None, :1] * around[None]
        return np.concatenate([flat, np.broadcast_to(rz[:, None, 1:], (*flat.shape[:2], 1))], axis=-1)

    both = np.concatenate([ring(profile), ring(normals)], axis=-1)
    a, b, c, d = both[:-1, :-1], both[:-1, 1:], both[1:, 1:], both[1:, :-1]
    triangles = np.stack([a, b, c, a, c, d], axis=2).reshape(-1, 3, 6)
    area = np.cross(triangles[:, 1, :3] - triangles[:, 0, :3], triangles[:, 2, :3] - triangles[:, 0, :3])
    kept = triangles[np.linalg.norm(area, axis=1) > 1e-14]
    return np.ascontiguousarray(kept.reshape(-1, 6), np.float32)


@lru_cache(maxsize=64)  # both arms' files; smoothing them takes most of the time to make a renderer
def _from_file(file: str, scale: tuple[float, float, float], parameters: MeshParameters) -> NDArray[np.float32]:
    mesh = trimesh.load(file, force="mesh", skip_materials=True)
    vertices, faces = _merge(np.asarray(mesh.vertices) * np.array(scale), np.asarray(mesh.faces), parameters.merge_cell)
    merged = trimesh.Trimesh(vertices, faces, process=False)
    face_normals = np.asarray(merged.face_normals)
    cosine = np.cos(np.deg2rad(parameters.smooth_angle_deg))
    return _rows(vertices[faces], _vertex_normals(faces, face_normals, np.asarray(merged.area_faces), cosine))


def _merge(vertices: FloatArray, faces: NDArray[np.int64], cell: float) -> tuple[FloatArray, NDArray[np.int64]]:
    """Merge the vertices in each cell of a grid, `cell` m wide, into their mean; drop faces that have no area left."""
    _, inverse = np.unique(np.rint(vertices / cell).astype(np.int64), axis=0, return_inverse=True)
    count = np.bincount(inverse)
    means = np.column_stack([np.bincount(inverse, vertices[:, i]) / count for i in range(3)])
    merged = inverse[faces]
    a, b, c = (means[merged[:, i]] for i in range(3))
    return means, merged[np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-10]


def _vertex_normals(faces: NDArray[np.int64], normals: FloatArray, area: FloatArray, cosine: float) -> FloatArray:
    """Normals (n, 3, 3) of the faces' corners.

    Each is the mean, weighted by area, over the vertex's faces whose normals have at least `cosine` with this face's.
    """
    order = np.argsort(faces.ravel(), kind="stable")
    begins = np.searchsorted(faces.ravel()[order], np.arange(int(faces.max()) + 2))
    out = _sum_normals(faces, normals, area, cosine, order // 3, begins)
    return out / np.linalg.norm(out, axis=2, keepdims=True)


@numba.njit(cache=True)
def _sum_normals(
    faces: NDArray[np.int64],
    normals: FloatArray,
    area: FloatArray,
    cosine: float,
    around: NDArray[np.int64],
    begins: NDArray[np.int64],
) -> FloatArray:
    """`_vertex_normals` before they have length 1; vertex v's faces are `around[begins[v]:begins[v + 1]]`."""
    out = np.zeros((len(faces), 3, 3))
    for face in range(len(faces)):
        for k in range(3):
            vertex = faces[face, k]
            for near in around[begins[vertex] : begins[vertex + 1]]:
                if np.sum(normals[near] * normals[face]) > cosine:
                    out[face, k] += area[near] * normals[near]
            if not np.any(out[face, k]):
                out[face, k] = normals[face]
    return out


def _rows(triangles: FloatArray, normals: FloatArray) -> NDArray[np.float32]:
    return np.ascontiguousarray(np.concatenate([triangles, normals], axis=2).reshape(-1, 6), np.float32)
