"""The light's view of a scene, in which the renderers draw their shadow maps."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.arrays import FloatArray
from regrasp.sim.render.meshes import SharedMesh


@dataclass(frozen=True)
class ShadowParameters:
    """The shadow map."""

    size: int = 1024  # texels a side; a texel covers about 2 mm of the cell
    largest_caster: float = 1.0  # m; items of a larger radius, such as the floor, receive shadows but cast none


DEFAULT_SHADOWS = ShadowParameters()


def rows_and_radii(meshes: Sequence[SharedMesh]) -> tuple[NDArray[np.int64], FloatArray]:
    """The rows (n,) of the items with these meshes, and their radii (n,) in m."""
    rows = [(row, mesh.radius) for mesh in meshes for row in mesh.rows]
    return np.array([row for row, _ in rows], np.int64), np.array([radius for _, radius in rows])


def light_from_world(
    centres: NDArray[np.floating[Any]], radii: FloatArray, to_light: FloatArray
) -> tuple[FloatArray, float]:
    """Matrix (4, 4) from the world to the light's view, and the radius (m) of the casters' bounding sphere.

    `centres` (n, 3) m and `radii` (n,) m are spheres about the casters; `to_light` (3,) is a unit vector.
    The light's view maps the sphere to 0..1. Its rows run downwards as the picture's do, so that the same sides of
    triangles are drawn.
    """
    low, high = -np.ones(3), np.ones(3)
    if len(centres):
        low, high = (centres - radii[:, None]).min(axis=0), (centres + radii[:, None]).max(axis=0)
    centre, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    side = np.cross(to_light, [1.0, 0.0, 0.0] if abs(to_light[0]) < 0.9 else [0.0, 1.0, 0.0])
    side /= np.linalg.norm(side)
    turn = np.array([side, np.cross(side, to_light), -to_light]) / (2 * radius)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, 0.5 - turn @ centre
    return matrix, radius
