from collections.abc import Callable

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from regrasp.app.robots.meshes import Triangles
from regrasp.app.robots.spheres import FitParameters, fit_spheres
from regrasp.interfaces.arrays import FloatArray

MARGIN = 0.02  # m
ROUGH = FitParameters(margin=MARGIN, voxels=1e4, candidates=500, points=300, tries=1)
lengths = st.floats(0.01, 0.3)


def surface(mesh: trimesh.Trimesh) -> Triangles:
    return Triangles(np.array(mesh.triangles, float))


def directions() -> FloatArray:
    return np.array(trimesh.creation.icosphere(subdivisions=3).vertices, float)


def uncovered(points: FloatArray, spheres: FloatArray) -> float:
    """How far the farthest point lies outside all spheres."""
    return float((np.linalg.norm(points[:, None] - spheres[:, :3], axis=2) - spheres[:, 3]).min(axis=1).max())


def excess(spheres: FloatArray, outside: Callable[[FloatArray], FloatArray]) -> float:
    """How far the spheres' surfaces stand out at most; `outside` says it of points (n, 3)."""
    points = spheres[:, None, :3] + spheres[:, None, 3:] * directions()
    return float(outside(points.reshape(-1, 3)).max())


def out_of_box(points: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(np.maximum(np.maximum(low - points, points - high), 0.0), axis=1))


@settings(max_examples=10)
@given(st.tuples(lengths, lengths, lengths))
def test_spheres_hold_a_box_and_keep_the_margin(size: tuple[float, float, float]) -> None:
    box = surface(trimesh.creation.box(extents=size))
    spheres = fit_spheres(box, ROUGH)
    half = 0.5 * np.array(size)
    assert uncovered(box.samples(0.004), spheres) <= 0.0
    assert uncovered(box.vertices, spheres) <= 0.0
    assert excess(spheres, lambda points: out_of_box(points, -half, half)) <= MARGIN


def test_spheres_hold_a_cylinder_and_keep_the_margin() -> None:
    radius, height = 0.05, 0.3
    cylinder = surface(trimesh.creation.cylinder(radius=radius, height=height, sections=64))
    spheres = fit_spheres(cylinder, FitParameters(margin=MARGIN))

    def outside(points: FloatArray) -> FloatArray:
        across = np.maximum(np.linalg.norm(points[:, :2], axis=1) - radius, 0.0)
        return np.asarray(np.hypot(across, np.maximum(np.abs(points[:, 2]) - height / 2, 0.0)))

    assert uncovered(cylinder.samples(0.003), spheres) <= 0.0
    assert excess(spheres, outside) <= MARGIN + 1e-4  # the mesh's sides lie 0.06 mm inside the cylinder
    assert len(spheres) <= 20


def test_spheres_of_an_angle_leave_its_notch_open() -> None:
    parts = [((0.0, 0.0, 0.0), (0.3, 0.06, 0.06)), ((0.0, 0.0, 0.0), (0.06, 0.3, 0.06))]
    boxes = [trimesh.creation.box(bounds=part) for part in parts]
    angle = surface(trimesh.util.concatenate(boxes))  # shells that cut each other: not watertight
    spheres = fit_spheres(angle, FitParameters(margin=MARGIN))

    def outside(points: FloatArray) -> FloatArray:
        return np.asarray(np.min([out_of_box(points, *map(np.array, part)) for part in parts], axis=0))

    assert uncovered(angle.samples(0.003), spheres) <= 0.0
    assert excess(spheres, outside) <= MARGIN
    assert uncovered(np.array([[0.15, 0.15, 0.03]]), spheres) > 0.05


def test_a_mesh_without_one_face_is_still_filled_where_the_hole_is_small() -> None:
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.1)
    ball.update_faces(np.arange(len(ball.faces)) > 0)
    spheres = fit_spheres(surface(ball), FitParameters(margin=MARGIN))
    assert len(spheres) == 1


def test_what_other_spheres_hold_needs_none() -> None:
    box = surface(trimesh.creation.box(extents=(0.1, 0.1, 0.1)))
    assert len(fit_spheres(box, ROUGH, np.array([[0.0, 0.0, 0.0, 0.1]]))) == 0
    half = fit_spheres(box, ROUGH, np.array([[0.05, 0.0, 0.0, 0.09]]))
    assert 0 < len(half) < len(fit_spheres(box, ROUGH))


def test_the_same_surface_gives_the_same_spheres() -> None:
    box = surface(trimesh.creation.box(extents=(0.2, 0.1, 0.05)))
    assert np.array_equal(fit_spheres(box, ROUGH), fit_spheres(box, ROUGH))


@pytest.mark.parametrize("spacing", [0.002, 0.01])
def test_samples_lie_as_near_to_any_point_as_asked(spacing: float) -> None:
    needle = Triangles(np.array([[[0.0, 0.0, 0.0], [0.4, 0.0, 0.0], [0.4, 0.001, 0.0]]]))
    wide = Triangles(np.array([[[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.05, 0.09, 0.02]]]))
    weights = np.random.default_rng(0).dirichlet((1, 1, 1), 2000)
    for triangle in (needle, wide):
        points = weights @ triangle.corners[0]
        samples = triangle.samples(spacing)
        assert np.linalg.norm(points[:, None] - samples, axis=2).min(axis=1).max() <= spacing
