"""Shapes of what stands in a cell, and how deep they reach into one another."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import ArmSpec, FixedMount, KnownCell
from regrasp.interfaces.fields import Size, Vector


@dataclass(frozen=True)
class JitteredBox:
    """A box, turned by `yaw_deg` about z, whose `center` (3,) m moves by up to `jitter` m along each axis."""

    center: FloatArray
    size: Size
    yaw_deg: float = 0.0
    jitter: Vector = (0.0, 0.0, 0.0)

    @cached_property
    def generators(self) -> FloatArray:
        """Half edges (6, 3) m of the box and of the region of its centres: their zonotope is the swept volume."""
        turn = Rotation.from_euler("z", self.yaw_deg, degrees=True).as_matrix()
        return np.vstack([half_edges(turn, self.size), np.diag(self.jitter)])


def line_depth(generators: FloatArray, center: FloatArray, points: FloatArray, radius: float) -> float:
    """How far (m) a line of this `radius` (m) through `points` (n, 3) m reaches into a box; at most 0 when apart.

    `generators` (m, 3) m are half edges, of the box and of the region of its `center` (3,) m.
    """
    links = ((0.5 * (b - a), center - 0.5 * (a + b)) for a, b in pairwise(points))
    return radius + max(penetration_depth(np.vstack([generators, half]), offset) for half, offset in links)


def penetration_depth(generators: FloatArray, offset: FloatArray) -> float:
    r"""How far (m) two boxes overlap; at most 0 when apart.

    Two convex bodies overlap if the offset of their centres lies in their Minkowski difference. Of two boxes that is
    the zonotope of all their half edges: `generators` g_i (n, 3) m. With `offset` o (3,) m and the unit normals n of
    the zonotope's facets the depth is

    .. math:: d = \min_n \left( \sum_i |g_i \cdot n| - |o \cdot n| \right)

    (Ericson, Real-Time Collision Detection, 2005, sections 3.11 and 5.2.1).
    """
    normals = _facet_normals(generators)
    reach = np.abs(generators @ normals.T).sum(axis=0)
    return float(np.min(reach - np.abs(normals @ offset)))


def cube_depths(generators: FloatArray, offsets: FloatArray, halves: FloatArray) -> FloatArray:
    """As `penetration_depth`, for a box and each of n upright cubes: `offsets` (n, 3), half edges `halves` (n,), m."""
    normals = _facet_normals(np.vstack([generators, np.eye(3)]))
    reach = np.abs(generators @ normals.T).sum(axis=0) + np.outer(halves, np.abs(normals).sum(axis=1))
    depths: FloatArray = np.min(reach - np.abs(offsets @ normals.T), axis=1)
    return depths


def _facet_normals(generators: FloatArray) -> FloatArray:
    """Unit normals (m, 3) of a zonotope's facets: the cross products of pairs of its generators (n, 3)."""
    first, second = np.triu_indices(len(generators), 1)
    normals = np.cross(generators[first], generators[second])
    lengths = np.linalg.norm(normals, axis=1)
    units: FloatArray = normals[lengths > 1e-12] / lengths[lengths > 1e-12, None]
    return units


def half_edges(turn: FloatArray, size: Size) -> FloatArray:
    """Half edges (3, 3) m, one per row, of a box of `size` m whose axes are the columns of `turn` (3, 3)."""
    return (turn * (0.5 * np.asarray(size))).T


def arm_base(arm: ArmSpec) -> tuple[str, FloatArray, FloatArray]:
    """Name, centre (3,) and half edges (3, 3), m, of an arm's base."""
    base, box = arm.world_from_base, arm.robot.footprint
    return f"the {arm.name} arm's base", base.apply(box.center), half_edges(base.rotation.as_matrix(), box.size)


def fixed_cameras(cell: KnownCell) -> list[tuple[str, FloatArray]]:
    """Names and positions (3,) m of the fixed cameras."""
    mounts = [(c.name, c.mount) for c in cell.cameras if isinstance(c.mount, FixedMount)]
    return [(name, np.array(mount.position)) for name, mount in mounts]


def sleeping_arm_cubes(arm: ArmSpec) -> tuple[FloatArray, FloatArray]:
    """Centres (n, 3) and half edges (n,), m, of the cubes inside the spheres that fill an arm in its sleep pose.

    Its base, which stands on something, does not count.
    """
    from regrasp.motion.robots.kinematics import ArmKinematics  # late: it brings the compiler

    body = arm.robot.body
    moving = body.links > 0
    spheres = body.spheres[moving]
    frames = ArmKinematics(arm.robot, arm.world_from_base).link_frames(np.array(arm.sleep))[body.links[moving]]
    centers = np.einsum("nij,nj->ni", frames[:, :3, :3], spheres[:, :3]) + frames[:, :3, 3]
    return centers, spheres[:, 3] / np.sqrt(3)
