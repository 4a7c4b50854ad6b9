"""Whether a path touches boxes, by coal on the triangles of the URDF: another engine, and no spheres."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import trimesh

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import Box
from regrasp.interfaces.robot.urdf import pose_of
from regrasp.motion.robots.kinematics import ArmKinematics


class MeshCheck:
    """An arm's collision meshes, with the jaw fully open, among boxes. Needs coal (extra `bench`)."""

    def __init__(self, kin: ArmKinematics, boxes: Sequence[Box], step: float = 0.005) -> None:
        """`step`: rad (m of a rail) of the joint that moves most between two checks of a path."""
        import coal

        self._coal: Any = coal
        self._kin, self._step = kin, step
        self._meshes = [part for part in self._parts() if part[0] >= kin.robot.body.first_moving]
        self._boxes = [(coal.Box(*box.size), coal.Transform3s(np.eye(3), np.array(box.center))) for box in boxes]

    def touches(self, path: FloatArray) -> bool:
        """Whether a mesh touches a box anywhere on the joint path (k, n)."""
        for a, b in pairwise(path):
            count = max(1, int(np.ceil(np.abs(b - a).max() / self._step)))
            if any(self._touches_at(a + (b - a) * (n / count)) for n in range(count + 1)):
                return True
        return False

    def _touches_at(self, q: FloatArray) -> bool:
        coal, frames = self._coal, self._kin.link_frames(q)
        for index, link_from_mesh, mesh in self._meshes:
            pose = frames[index] @ link_from_mesh
            place = coal.Transform3s(pose[:3, :3], pose[:3, 3])
            for box, at in self._boxes:
                if coal.collide(mesh, place, box, at, coal.CollisionRequest(), coal.CollisionResult()):
                    return True
        return False

    def _parts(self) -> list[tuple[int, FloatArray, Any]]:
        """The chain's link, link_from_mesh (4, 4) and mesh of each collision mesh of the URDF."""
        robot, found = self._kin.robot, []
        for link in robot.element().findall("link"):
            for shape in link.findall("collision"):
                mesh = shape.find("geometry/mesh")
                if mesh is None:
                    continue
                index, pose = robot.link_place(str(link.get("name")))
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
