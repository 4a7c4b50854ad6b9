"""Convex pieces of a robot's collision meshes: PyBullet takes the hull of a mesh, which fills what is hollow in it.

The hull of a ViperX's upper arm has two and a half times the room of its pieces, and stands up to 44 mm off the arm.
"""

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial import QhullError

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.robot import urdf


@dataclass(frozen=True)
class ConvexPieceParameters:
    """How a mesh is cut."""

    slab: float = 0.03  # m, about the thickness of a slab; choice: a link of an arm is 60 to 100 mm thick
    alike: float = 1.1  # times their room that the hull of two neighbours may have so that they stay one piece; choice


def split_concave(root: ET.Element, folder: Path, parameters: ConvexPieceParameters = ConvexPieceParameters()) -> None:
    """Replace each concave collision mesh of a URDF by a file of its convex pieces, which is written to `folder`."""
    for number, collision in enumerate(root.iter("collision")):
        mesh = collision.find("geometry/mesh")
        if mesh is None:
            continue
        x, y, z = map(float, mesh.get("scale", "1 1 1").split())
        pieces = convex_pieces(str(mesh.get("filename")), (x, y, z), parameters)
        if len(pieces) > 1:
            path = folder / f"pieces_{number}.obj"
            path.write_text(_obj(pieces), encoding="utf-8")
            mesh.set("filename", str(path))
            mesh.set("scale", urdf.numbers((1.0, 1.0, 1.0)))


@lru_cache(maxsize=64)  # the same files for both arms, and for each run of a process
def convex_pieces(
    file: str, scale: tuple[float, float, float], parameters: ConvexPieceParameters = ConvexPieceParameters()
) -> tuple[trimesh.Trimesh, ...]:
    """The hulls of the slabs of a mesh, cut across its longest axis; neighbours that are as good as convex are one.

    None of a sheet, and where trimesh cannot read the file: then the mesh stays what PyBullet takes it for.
    """
    try:
        return tuple(_pieces(trimesh.load(file, force="mesh", skip_materials=True), scale, parameters))
    except (ImportError, ValueError, QhullError):
        return ()


def _pieces(
    mesh: trimesh.Trimesh, scale: tuple[float, float, float], parameters: ConvexPieceParameters
) -> list[trimesh.Trimesh]:
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    vertices = np.asarray(mesh.vertices) * np.array(scale)
    edges = np.asarray(mesh.edges_unique)
    spans = np.ptp(vertices, axis=0)
    if spans.min() < 1e-6 * spans.max():
        return []  # a sheet
    hull = trimesh.convex.convex_hull(vertices)
    if mesh.is_watertight and hull.volume <= parameters.alike * mesh.volume * abs(np.prod(scale)):
        return [hull]
    along = int(np.argmax(spans))
    low, high = vertices[:, along].min(), vertices[:, along].max()
    cuts = np.linspace(low, high, max(round((high - low) / parameters.slab), 1) + 1)
    slabs = [_slab(vertices, edges, along, a, b) for a, b in pairwise(cuts)]
    pieces = [trimesh.convex.convex_hull(slab) for slab in slabs if len(slab)]  # a mesh may have a gap
    i = 0
    while i + 1 < len(pieces):
        both = trimesh.convex.convex_hull(np.vstack([piece.vertices for piece in pieces[i : i + 2]]))
        if both.volume <= parameters.alike * sum(piece.volume for piece in pieces[i : i + 2]):
            pieces[i : i + 2] = [both]
        else:
            i += 1
    return pieces


def _slab(vertices: FloatArray, edges: FloatArray, along: int, low: float, high: float) -> FloatArray:
    """The corners (n, 3) of the part of a mesh between two planes across an axis: its vertices, and cut edges."""
    corners = [vertices[(vertices[:, along] >= low) & (vertices[:, along] <= high)]]
    start, end = vertices[edges[:, 0]], vertices[edges[:, 1]]
    for plane in (low, high):
        crossing = (start[:, along] - plane) * (end[:, along] - plane) < 0.0
        a, b = start[crossing], end[crossing]
        share = (plane - a[:, along]) / (b[:, along] - a[:, along])
        corners.append(a + share[:, None] * (b - a))
    return np.vstack(corners)


def _obj(pieces: Sequence[trimesh.Trimesh]) -> str:
    """The text of an OBJ file with an object for each piece, of which PyBullet takes the hull one by one."""
    lines, first = [], 1
    for i, piece in enumerate(pieces):
        lines.append(f"o piece_{i}")
        lines += [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in piece.vertices]
        lines += [f"f {a + first} {b + first} {c + first}" for a, b, c in piece.faces]
        first += len(piece.vertices)
    return "\n".join(lines) + "\n"
