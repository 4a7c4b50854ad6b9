"""Whether a path touches something, by coal on the triangles of the URDF: another engine, and no spheres."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
import trimesh
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import Box
from regrasp.interfaces.robot.urdf import pose_of
from regrasp.motion.robots.kinematics import ArmKinematics


@dataclass(frozen=True, eq=False)
class Standing:
    """An arm that stands at joints (n,) with its pads `opening` m apart; None: fully open."""

    kin: ArmKinematics
    joints: FloatArray
    opening: float | None = None


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What an arm may touch: boxes as they stand in a cell, others each with its pose (world_from_box), other arms."""

    boxes: Sequence[Box] = ()
    turned: Sequence[tuple[Box, RigidTransform]] = ()
    arms: Sequence[Standing] = field(default=())


@dataclass(frozen=True, eq=False)
class Carried:
    """What a link of the chain carries, at link_from_thing (4, 4).

    `size` in m: (x, y, z) edges of a box, or (length, radius) of a cylinder along x.
    """

    link: int
    link_from_thing: FloatArray
    size: tuple[float, ...]


class MeshCheck:
    """An arm's collision meshes, and what it carries, among things. Needs coal (extra `bench`)."""

    def __init__(
        self,
        kin: ArmKinematics,
        around: Surroundings,
        step: float = 0.005,
        opening: float | None = None,
        carried: Sequence[Carried] = (),
    ) -> None:
        """`step`: rad (m of a rail) of the joint that moves most between two checks of a path.

        The pads stand `opening` m apart, None: fully open.
        """
        import coal

        self._coal: Any = coal
        self._kin, self._step = kin, step
        self._meshes = [part for part in self._parts(kin, opening) if part[0] >= kin.robot.body.first_moving]
        self._meshes += [self._carried(thing) for thing in carried]
        self._around = list(self._things(around))

    def touches(self, path: FloatArray) -> bool:
        """Whether a mesh touches a thing anywhere on the joint path (k, n)."""
        return self.first_touch(path) is not None

    def first_touch(self, path: FloatArray) -> str | None:
        """The name of the first thing that a mesh touches on the joint path (k, n); None if it touches nothing."""
        for a, b in pairwise(path):
            count = max(1, int(np.ceil(np.abs(b - a).max() / self._step)))
            for n in range(count + 1):
                if (what := self._touched_at(a + (b - a) * (n / count))) is not None:
                    return what
        return None

    def _touched_at(self, q: FloatArray) -> str | None:
        coal, frames = self._coal, self._kin.link_frames(q)
        for index, link_from_mesh, mesh in self._meshes:
            place = self._place(frames[index] @ link_from_mesh)
            for name, thing, at in self._around:
                if coal.collide(mesh, place, thing, at, coal.CollisionRequest(), coal.CollisionResult()):
                    return name
        return None

    def _carried(self, thing: Carried) -> tuple[int, FloatArray, Any]:
        if len(thing.size) == 3:
            return thing.link, thing.link_from_thing, self._coal.Box(*thing.size)
        length, radius = thing.size
        across = RigidTransform.from_rotation(Rotation.from_euler("y", 90, degrees=True))  # coal's lie along z
        return thing.link, thing.link_from_thing @ across.as_matrix(), self._coal.Cylinder(radius, length)

    def _things(self, around: Surroundings) -> Iterator[tuple[str, Any, Any]]:
        """Name, shape and place of everything around."""
        upright = ((box, RigidTransform.from_translation(box.center)) for box in around.boxes)
        for box, pose in (*upright, *around.turned):
            yield box.name, self._coal.Box(*box.size), self._place(pose.as_matrix())
        for arm in around.arms:
            frames = arm.kin.link_frames(arm.joints)
            for index, link_from_mesh, mesh in self._parts(arm.kin, arm.opening):
                yield "other arm", mesh, self._place(frames[index] @ link_from_mesh)

    def _place(self, pose: FloatArray) -> Any:
        return self._coal.Transform3s(pose[:3, :3], pose[:3, 3])

    def _parts(self, kin: ArmKinematics, opening: float | None) -> list[tuple[int, FloatArray, Any]]:
        """The chain's link, link_from_mesh (4, 4) and mesh of each collision mesh of the URDF."""
        robot, found = kin.robot, []
        for link in robot.element().findall("link"):
            for shape in link.findall("collision"):
                mesh = shape.find("geometry/mesh")
                if mesh is None:
                    continue
                index, pose = robot.link_place(str(link.get("name")), opening)
                origin = shape.find("origin")
                xyz, rpy = (
                    tuple(map(float, (origin.get(key, "0 0 0") if origin is not None else "0 0 0").split()))
                    for key in ("xyz", "rpy")
                )
                scale = np.array([float(value) for value in mesh.get("scale", "1 1 1").split()])
                found.append((index, pose @ pose_of(xyz, rpy), self._model(str(mesh.get("filename")), scale)))
        return found

    def _model(self, file: str, scale: FloatArray) -> Any:
        coal, mesh = self._coal, trimesh.load(file, force="mesh")
        points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
        points.extend([np.asarray(point) for point in np.asarray(mesh.vertices) * scale])
        triangles.extend([coal.Triangle(*map(int, face)) for face in np.asarray(mesh.faces)])
        model = coal.BVHModelOBBRSS()
        model.beginModel(len(triangles), len(points))
        model.addSubModel(points, triangles)
        model.endModel()
        return model
