"""Triangles of visual items, for the renderer."""

from functools import lru_cache

import numpy as np
import pybullet as p
import trimesh
from numpy.typing import NDArray

from regrasp.sim.render.visuals import VisualItem

FloatArray = NDArray[np.float64]
CELL = 0.002  # metres: details of mesh files finer than this are merged; a pixel covers 1.4 mm at 0.9 m
SMOOTH = np.cos(np.deg2rad(40.0))  # faces that meet at a smaller angle share a normal


def corners(item: VisualItem) -> NDArray[np.float32]:
    """Positions and unit normals of the item's triangle corners in its visual frame: (3 n, 6), metres."""
    kind, size = item.kind, item.size
    if kind == p.GEOM_MESH:
        return _from_file(item.file, size)
    if kind == p.GEOM_BOX:
        box = trimesh.creation.box(size)
        return _rows(box.triangles, np.repeat(box.face_normals[:, None], 3, axis=1))
    if kind == p.GEOM_SPHERE:
        return _lathe(*_arc(size[0], 0.0, np.linspace(-90, 90, 13)))
    length, radius = size[0], size[1]
    if kind == p.GEOM_CYLINDER:
        side = np.array([[radius, -length / 2], [radius, length / 2]])
        outline = np.array([[0, -length / 2], side[0], side[0], side[1], side[1], [0, length / 2]])
        return _lathe(outline, np.array([[0, -1], [0, -1], [1, 0], [1, 0], [0, 1], [0, 1]], float))
    if kind == p.GEOM_CAPSULE:
        halves = [_arc(radius, h * length / 2, np.linspace(min(0, h * 90), max(0, h * 90), 4)) for h in (-1, 1)]
        return _lathe(np.vstack([o for o, _ in halves]), np.vstack([n for _, n in halves]))
    raise ValueError(f"body {item.body} link {item.link}: no way to draw PyBullet geometry {kind}")


def _arc(radius: float, height: float, angles_deg: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Outline (m, 2) in (r, z) of a circle's arc about (0, height), and its normals."""
    angles = np.deg2rad(angles_deg)
    normals = np.column_stack([np.cos(angles), np.sin(angles)])
    return radius * normals + [0.0, height], normals


def _lathe(outline: FloatArray, normals: FloatArray) -> NDArray[np.float32]:
    """Corners of the surface that an outline (m, 2) in (r, z), bottom to top, sweeps about z."""
    sides = 12 if outline[:, 0].max() < 0.006 else 24
    turns = np.arange(sides + 1) * (2 * np.pi / sides)
    # between the circles inside and around the polygon, so that its mean width is right
    outline = outline * [2 / (1 + np.cos(np.pi / sides)), 1.0]
    around = np.stack([np.cos(turns), np.sin(turns)], axis=-1)

    def ring(profile: FloatArray) -> FloatArray:
        flat = profile[:, None, :1] * around[None]
        return np.concatenate([flat, np.broadcast_to(profile[:, None, 1:], (*flat.shape[:2], 1))], axis=-1)

    both = np.concatenate([ring(outline), ring(normals)], axis=-1)
    a, b, c, d = both[:-1, :-1], both[:-1, 1:], both[1:, 1:], both[1:, :-1]
    triangles = np.stack([a, b, c, a, c, d], axis=2).reshape(-1, 3, 6)
    area = np.cross(triangles[:, 1, :3] - triangles[:, 0, :3], triangles[:, 2, :3] - triangles[:, 0, :3])
    kept = triangles[np.linalg.norm(area, axis=1) > 1e-14]
    return np.ascontiguousarray(kept.reshape(-1, 6), np.float32)


@lru_cache(maxsize=64)  # both arms' files; smoothing them takes most of a renderer's making
def _from_file(file: str, scale: tuple[float, float, float]) -> NDArray[np.float32]:
    mesh = trimesh.load(file, force="mesh")
    vertices, faces = _merge(np.asarray(mesh.vertices) * np.array(scale), np.asarray(mesh.faces))
    merged = trimesh.Trimesh(vertices, faces, process=False)
    faces_normals = np.asarray(merged.face_normals)
    return _rows(vertices[faces], _smooth(faces, faces_normals, np.asarray(merged.area_faces)))


def _merge(vertices: FloatArray, faces: NDArray[np.int64]) -> tuple[FloatArray, NDArray[np.int64]]:
    """Vertices within one cell of a grid become one, at their mean; faces without area go."""
    _, inverse = np.unique(np.rint(vertices / CELL).astype(np.int64), axis=0, return_inverse=True)
    count = np.bincount(inverse)
    means = np.column_stack([np.bincount(inverse, vertices[:, i]) / count for i in range(3)])
    merged = inverse[faces]
    a, b, c = (means[merged[:, i]] for i in range(3))
    return means, merged[np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-10]


def _smooth(faces: NDArray[np.int64], normals: FloatArray, area: FloatArray) -> FloatArray:
    """Normals (n, 3, 3) of corners: the mean over the faces about the vertex that are not too steep to this face."""
    around: list[list[int]] = [[] for _ in range(int(faces.max()) + 1)]
    for face, corner in enumerate(faces):
        for vertex in corner:
            around[vertex].append(face)
    out = np.empty((len(faces), 3, 3))
    for face, corner in enumerate(faces):
        for k, vertex in enumerate(corner):
            near = np.array(around[vertex])
            near = near[normals[near] @ normals[face] > SMOOTH]
            out[face, k] = area[near] @ normals[near] if len(near) else normals[face]
    return out / np.linalg.norm(out, axis=2, keepdims=True)


def _rows(triangles: FloatArray, normals: FloatArray) -> NDArray[np.float32]:
    return np.ascontiguousarray(np.concatenate([triangles, normals], axis=2).reshape(-1, 6), np.float32)
