"""Collision meshes that are concave are cut into convex pieces for PyBullet."""

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from regrasp.app.files.resources import shipped
from regrasp.app.scenario.cell_file import load_cell
from regrasp.interfaces.robot.robot import Robot
from regrasp.interfaces.robot.urdf import pose_of
from regrasp.sim.robot.convex import convex_pieces, split_concave

MESH = '<geometry><mesh filename="{}" scale="{}" /></geometry>'
URDF = f'<robot name="one"><link name="body"><collision>{MESH}</collision></link></robot>'


@pytest.fixture
def angle(tmp_path: Path) -> Path:
    """An L of two bars of 0.2 x 0.04 x 0.04 m: one along z, and one from its foot along x."""
    bars = [
        trimesh.creation.box((0.04, 0.04, 0.2), trimesh.transformations.translation_matrix((0.0, 0.0, 0.1))),
        trimesh.creation.box((0.16, 0.04, 0.04), trimesh.transformations.translation_matrix((0.10, 0.0, 0.02))),
    ]
    path = tmp_path / "angle.obj"
    trimesh.util.concatenate(bars).export(path)
    return path


def outside(piece: trimesh.Trimesh, points: Any) -> Any:
    """How far (n,) m points are out of a convex mesh, by the planes of its faces; below 0 within."""
    off = np.asarray(points)[:, None] - piece.triangles[None, :, 0]
    return np.einsum("nfi,fi->nf", off, piece.face_normals).max(axis=1)


def test_the_pieces_of_an_angle_leave_its_inside_free(angle: Path) -> None:
    pieces = convex_pieces(str(angle), (1.0, 1.0, 1.0))
    whole = trimesh.load(angle, force="mesh")
    assert len(pieces) > 1
    assert sum(piece.volume for piece in pieces) < 0.75 * whole.convex_hull.volume
    assert min(outside(piece, [[0.12, 0.0, 0.08]])[0] for piece in pieces) > 0.03
    covered = np.min([outside(piece, whole.vertices) for piece in pieces], axis=0)
    assert covered.max() < 1e-9  # no corner of the mesh is left out


def test_a_convex_mesh_stays_one_piece_and_its_file(tmp_path: Path) -> None:
    path = tmp_path / "ball.obj"
    trimesh.creation.icosphere(radius=0.1).export(path)
    assert len(convex_pieces(str(path), (1.0, 1.0, 2.0))) == 1
    text = URDF.format(path, "1 1 1")
    root = ET.fromstring(text)
    split_concave(root, tmp_path)
    assert ET.tostring(root, encoding="unicode") == text


def test_parts_with_a_gap_between_are_a_piece_each(tmp_path: Path) -> None:
    ends = [
        trimesh.creation.box((0.04, 0.04, 0.04), trimesh.transformations.translation_matrix((x, 0.0, 0.0)))
        for x in (0.0, 0.3)
    ]
    path = tmp_path / "ends.obj"
    trimesh.util.concatenate(ends).export(path)
    pieces = convex_pieces(str(path), (1.0, 1.0, 1.0))
    assert [piece.volume for piece in pieces] == pytest.approx([0.04**3, 0.04**3])


def test_a_sheet_and_a_file_that_is_no_mesh_are_left_as_they_are(tmp_path: Path) -> None:
    sheet, other = tmp_path / "sheet.obj", tmp_path / "other.obj"
    sheet.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n")
    other.write_text("nothing")
    for path in (sheet, other, tmp_path / "scene.dae"):
        assert convex_pieces(str(path), (1.0, 1.0, 1.0)) == ()


def test_a_concave_mesh_is_replaced_by_a_file_of_its_pieces_in_its_scale(angle: Path, tmp_path: Path) -> None:
    root = ET.fromstring(URDF.format(angle, "2 2 2"))
    split_concave(root, tmp_path)
    mesh = root.find("link/collision/geometry/mesh")
    assert mesh is not None
    assert mesh.get("scale") == "1.0 1.0 1.0"
    made = trimesh.load(str(mesh.get("filename")), force="mesh")
    assert np.ptp(made.vertices, axis=0) == pytest.approx([0.4, 0.08, 0.4])


@pytest.mark.parametrize(("cell", "arm"), [("thesis", "left"), ("habitat", "arm")])
def test_planning_knows_of_all_that_an_arm_touches_with(cell: str, arm: str) -> None:
    """The corners of what PyBullet collides with lie in the spheres that planning takes for the arm, to 7 mm."""
    robot = load_cell(shipped("cell")[cell]).known.arm(arm).robot
    tree = robot.tree
    spheres = np.vstack([[(*tree.frame(link) @ (x, y, z, 1.0), r)] for link, (x, y, z, r) in every_sphere(robot)])
    for link in robot.element().findall("link"):
        name = str(link.get("name"))
        if name in robot.spheres and name not in robot.still:
            for points in (tree.frame(name) @ corners for corners in corners_of(link)):
                off = np.linalg.norm(points[:3].T[:, None] - spheres[:, :3], axis=2) - spheres[:, 4]
                assert off.min(axis=1).max() < 0.007, name


def every_sphere(robot: Robot) -> Iterator[tuple[str, Any]]:
    for link, spheres in robot.spheres.items():
        yield from ((link, sphere) for sphere in spheres)


def corners_of(link: ET.Element) -> Iterator[Any]:
    """The corners (4, n) of a link's convex pieces, in its frame; the last row is 1."""
    for collision in link.findall("collision"):
        mesh, origin = collision.find("geometry/mesh"), collision.find("origin")
        if mesh is None:
            continue
        pose = np.eye(4)
        if origin is not None:
            x, y, z = map(float, origin.get("xyz", "0 0 0").split())
            roll, pitch, yaw = map(float, origin.get("rpy", "0 0 0").split())
            pose = pose_of((x, y, z), (roll, pitch, yaw))
        a, b, c = map(float, mesh.get("scale", "1 1 1").split())
        for piece in convex_pieces(str(mesh.get("filename")), (a, b, c)):
            yield pose @ np.column_stack([piece.vertices, np.ones(len(piece.vertices))]).T
