"""How well a robot's spheres cover its links, measured."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from regrasp.app.robots.meshes import Triangles, joined, surfaces
from regrasp.app.robots.solid import Solid
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.robot.parts import ParallelGripper
from regrasp.interfaces.robot.robot import Robot

_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))  # rad between two points of a Fibonacci lattice


@dataclass(frozen=True)
class MeasureParameters:
    """How finely the cover is measured."""

    voxels: float = 3e4  # in the box around a group of links, about
    least: float = 1.5e-3  # m, the edge of a voxel at least; points of the surface lie half of it apart
    directions: int = 400  # in which a sphere's surface is looked at


@dataclass(frozen=True)
class LinkMeasure:
    """Of a link's geometry the farthest point out of the spheres of its group, and of its spheres the farthest out.

    Metres. `outside` is negative if all of it lies inside, and None without geometry; `excess` is None without
    spheres. `spheres` counts the link's own, `group` those of all links that are fixed to it, too. `moves` says
    whether the link is one that something around can meet.
    """

    link: str
    moves: bool
    spheres: int
    group: int
    outside: float | None
    excess: float | None


def measure_cover(
    robot: Robot,
    spheres: Mapping[str, FloatArray] | None = None,
    parameters: MeasureParameters | None = None,
) -> list[LinkMeasure]:
    """The cover of every link that has geometry or spheres, in the URDF's order; of these spheres instead of its own.

    `spheres` are (n, 4) m by link, in its frame. Raises RobotError: the file of a mesh is missing.
    """
    own = own_spheres(robot) if spheres is None else spheres
    geometry = surfaces(robot.element())
    groups = [[link for link in group if link in geometry or link in own] for group in rigid_groups(robot)]
    found = [m for group in groups if group for m in _measured(robot, group, geometry, own, parameters)]
    return sorted(found, key=lambda measure: robot.tree.links.index(measure.link))


def own_spheres(robot: Robot) -> dict[str, FloatArray]:
    """The spheres (n, 4) m of each link in its frame, as the robot's file gives them."""
    return {link: np.array(rows, float).reshape(-1, 4) for link, rows in robot.spheres.items()}


def rigid_groups(robot: Robot) -> list[list[str]]:
    """The links that are fixed to one another, each with the links in the URDF's order.

    A joint that turns for show is held, and so counts as fixed.
    """
    held = set(robot.gripper.spin) if isinstance(robot.gripper, ParallelGripper) else set()
    groups: dict[str, list[str]] = {}
    for link in robot.tree.links:
        moved_by = [joint.name for joint in robot.tree.way_to(link) if joint.kind != "fixed" and joint.name not in held]
        groups.setdefault(moved_by[-1] if moved_by else "", []).append(link)
    return list(groups.values())


def group_spheres(robot: Robot, link: str, group: list[str], spheres: Mapping[str, FloatArray]) -> FloatArray:
    """The spheres (n, 4) m of a rigid group, in the frame of its `link`."""
    moved = []
    for other in group:
        if other in spheres:
            pose = _link_from(robot, link, other)
            moved.append(np.column_stack([spheres[other][:, :3] @ pose[:3, :3].T + pose[:3, 3], spheres[other][:, 3]]))
    return np.concatenate([np.empty((0, 4)), *moved])


def _measured(
    robot: Robot,
    group: list[str],
    geometry: Mapping[str, Triangles],
    spheres: Mapping[str, FloatArray],
    parameters: MeasureParameters | None,
) -> list[LinkMeasure]:
    first, parameters = group[0], parameters or MeasureParameters()
    parts = {link: geometry[link].moved(_link_from(robot, first, link)) for link in group if link in geometry}
    balls = group_spheres(robot, first, group, spheres)
    solid = _filled(joined(list(parts.values())), parameters) if parts else None
    moves = robot.link_place(first)[0] >= robot.body.first_moving
    measures = []
    for link in group:
        own = group_spheres(robot, first, [link], spheres)
        measure = LinkMeasure(link, moves, len(own), len(balls), None, None)
        if solid is not None and link in parts and len(balls):
            points = np.concatenate([parts[link].vertices, parts[link].samples(solid.spacing)])
            measure = replace(measure, outside=float(_out_of(balls, points).max()))
        if solid is not None and len(own):
            measure = replace(measure, excess=float(_excess(own, solid, parameters.directions).max()))
        measures.append(measure)
    return measures


def _filled(surface: Triangles, parameters: MeasureParameters) -> Solid:
    volume = float(np.prod(np.ptp(surface.vertices, axis=0)))
    pitch = max((volume / parameters.voxels) ** (1 / 3), parameters.least)
    return Solid.of(surface, pitch, 0.5 * pitch)


def _link_from(robot: Robot, link: str, other: str) -> FloatArray:
    frames = [robot.tree.frame(name) for name in (link, other)]
    return np.asarray(np.linalg.inv(frames[0]) @ frames[1])


def _out_of(spheres: FloatArray, points: FloatArray) -> FloatArray:
    """How far (n,) m points (n, 3) lie out of the nearest sphere's surface; negative inside."""
    nearest = np.full(len(points), np.inf)
    for sphere in spheres:
        nearest = np.minimum(nearest, np.linalg.norm(points - sphere[:3], axis=1) - sphere[3])
    return nearest


def _excess(spheres: FloatArray, solid: Solid, directions: int) -> FloatArray:
    """How far (n,) m each sphere's surface stands out of a solid at most."""
    units = _lattice(directions)
    return np.array([solid.outside(center + radius * units).max() for *center, radius in spheres])


def _lattice(count: int) -> FloatArray:
    """Unit vectors (count, 3), spread evenly: Fibonacci's lattice."""
    turns, z = _GOLDEN * np.arange(count), 1 - 2 * (np.arange(count) + 0.5) / count
    across = np.sqrt(1 - z**2)
    return np.column_stack([across * np.cos(turns), across * np.sin(turns), z])
