"""The geometry of a robot's links by its URDF: triangles in the links' frames, and points spread over them."""

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.robot import urdf
from regrasp.interfaces.robot.urdf import RobotError

Shape = Literal["collision", "visual"]
_ROUND = 4  # subdivisions of an icosphere: 0.1 % of its radius lies between its faces and the sphere
_SECTIONS = 96  # of a cylinder: 0.05 % of its radius


@dataclass(frozen=True, eq=False)
class Triangles:
    """A surface: `corners` (n, 3, 3) m of n triangles. It may be open, or cut itself."""

    corners: FloatArray

    @property
    def vertices(self) -> FloatArray:
        """The corners, each once, (m, 3)."""
        return np.unique(self.corners.reshape(-1, 3), axis=0)

    def moved(self, pose: FloatArray) -> "Triangles":
        """The surface in another frame, by new_from_old (4, 4)."""
        return Triangles(self.corners @ pose[:3, :3].T + pose[:3, 3])

    def samples(self, spacing: float) -> FloatArray:
        """Points (m, 3) of the surface such that none of it lies farther than `spacing` m from the nearest one."""
        # A point of a triangle whose sides are at most `side` is within side / sqrt(3) of a corner; of the corners one
        # in each cube of this edge is kept, within edge * sqrt(3) of the others.
        side, edge = 0.7 * spacing * np.sqrt(3.0), 0.3 * spacing / np.sqrt(3.0)
        points = _bisected(self.corners, side).reshape(-1, 3)
        cells = np.floor((points - points.min(axis=0)) / edge).astype(np.int64)
        keys = np.ravel_multi_index(tuple(cells.T), tuple(cells.max(axis=0) + 1))
        return np.asarray(points[np.unique(keys, return_index=True)[1]])


def joined(parts: list[Triangles]) -> Triangles:
    """All surfaces as one."""
    return Triangles(np.concatenate([np.empty((0, 3, 3)), *(part.corners for part in parts)]))


def surfaces(root: ET.Element, shape: Shape = "collision") -> dict[str, Triangles]:
    """The surface of each link that has one: its collision geometry, else the visual; `visual`: the other way round.

    Raises RobotError: the file of a mesh is missing, or cannot be read.
    """
    found = {str(link.get("name")): _surface(link, shape) for link in root.findall("link")}
    return {name: surface for name, surface in found.items() if len(surface.corners)}


def missing_meshes(root: ET.Element) -> Iterator[tuple[str, str]]:
    """The link of each mesh whose file is missing, and a sentence that says so."""
    told = set()
    for link, path in urdf.mesh_files(root):
        if not path.is_file() and (link, path) not in told:
            told.add((link, path))
            yield link, _is_missing(link, path)


def _surface(link: ET.Element, shape: Shape) -> Triangles:
    tags = ("collision", "visual") if shape == "collision" else ("visual", "collision")
    elements = next((found for tag in tags if (found := link.findall(tag))), [])
    return joined([_placed(str(link.get("name")), element) for element in elements])


def _placed(link: str, element: ET.Element) -> Triangles:
    origin = element.find("origin")
    numbers = {key: "0 0 0" if origin is None else origin.get(key, "0 0 0") for key in ("xyz", "rpy")}
    pose = urdf.pose_of(*(tuple(map(float, numbers[key].split())) for key in ("xyz", "rpy")))
    geometry = element.find("geometry")
    kinds = [] if geometry is None else list(geometry)
    return joined([Triangles(_corners(link, kind)) for kind in kinds]).moved(pose)


def _corners(link: str, kind: ET.Element) -> FloatArray:
    import trimesh

    if kind.tag == "box":
        made = trimesh.creation.box(extents=_floats(kind.get("size", "")))
    elif kind.tag == "sphere":
        made = trimesh.creation.icosphere(subdivisions=_ROUND, radius=float(kind.get("radius", "")))
    elif kind.tag == "cylinder":
        sizes = {"radius": float(kind.get("radius", "")), "height": float(kind.get("length", ""))}
        made = trimesh.creation.cylinder(**sizes, sections=_SECTIONS)
    elif kind.tag == "mesh":
        return _read(link, Path(str(kind.get("filename")))) * _floats(kind.get("scale", "1 1 1"))
    else:
        raise RobotError(("urdf",), f"the link {link} has a {kind.tag}; expected a mesh, box, sphere or cylinder")
    return np.asarray(made.triangles, float)


def _read(link: str, path: Path) -> FloatArray:
    import trimesh

    if not path.is_file():
        raise RobotError(("urdf",), _is_missing(link, path))
    try:
        mesh: Any = trimesh.load(str(path), force="mesh", process=False, skip_materials=True)
    except Exception as error:  # whatever its readers raise for a file that they do not like
        raise RobotError(("urdf",), f"the mesh {path} of the link {link} cannot be read: {error}") from None
    if not len(mesh.triangles):
        raise RobotError(("urdf",), f"the mesh {path} of the link {link} has no triangles; export it again")
    return np.asarray(mesh.triangles, float)


def _is_missing(link: str, path: Path) -> str:
    return f"the mesh {path} of the link {link} is missing; put it there, or correct the URDF or ros_packages"


def _floats(text: str) -> FloatArray:
    return np.array(text.split(), float)


def _bisected(corners: FloatArray, side: float) -> FloatArray:
    """The triangles with the longest side of each halved until no side is longer than `side` m.

    Quartering them, as is usual, would make thousands of a needle.
    """
    done, rows = [], np.arange(3)
    while len(corners):
        lengths = np.linalg.norm(corners - corners[:, (rows + 1) % 3], axis=2)
        long = lengths.max(axis=1) > side
        done.append(corners[~long])
        corners, longest = corners[long], lengths[long].argmax(axis=1)
        a, b, c = (corners[np.arange(len(corners)), (longest + step) % 3] for step in range(3))
        middle = 0.5 * (a + b)
        corners = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
    return np.concatenate([np.empty((0, 3, 3)), *done])
