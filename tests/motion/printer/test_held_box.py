"""Boxes in a hand: their spheres cover them, and where they are put down they lie inside their box."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cell import Box
from regrasp.motion.printer.held_box import HeldBox

EDGE = st.floats(0.004, 0.2)
NUMBER = st.floats(-1.0, 1.0)


def pose(numbers: tuple[float, ...]) -> RigidTransform:
    return RigidTransform.from_components(numbers[:3], Rotation.from_rotvec(3.0 * np.array(numbers[3:])))


@given(st.tuples(EDGE, EDGE, EDGE), st.tuples(*[NUMBER] * 6), st.floats(0.01, 0.05))
def test_the_spheres_cover_the_box_and_stand_out_little(
    size: tuple[float, float, float], at: tuple[float, ...], spacing: float
) -> None:
    held = HeldBox(Box(name="box", center=(0.0, 0.0, 0.0), size=size), pose(at), spacing)
    corners = np.stack(np.meshgrid(*[np.linspace(-0.5, 0.5, 7)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    points = pose(at).apply(corners * np.array(size))
    gaps = np.linalg.norm(points[:, None] - held.spheres[None, :, :3], axis=2) - held.spheres[:, 3]
    assert gaps.min(axis=1).max() < 1e-9
    assert held.spheres[:, 3].max() <= 0.5 * np.sqrt(3) * spacing + 1e-9


@given(st.tuples(EDGE, EDGE, EDGE), st.tuples(*[NUMBER] * 6), st.tuples(*[NUMBER] * 6))
def test_a_box_that_was_turned_in_the_hand_lies_inside_the_box_that_it_leaves(
    size: tuple[float, float, float], at: tuple[float, ...], tool: tuple[float, ...]
) -> None:
    held = HeldBox(Box(name="box", center=(0.0, 0.0, 0.0), size=size), pose(at), 0.02)
    left = held.placed(pose(tool))
    corners = np.stack(np.meshgrid(*[(-0.5, 0.5)] * 3, indexing="ij"), axis=-1).reshape(-1, 3) * np.array(size)
    points = (pose(tool) * pose(at)).apply(corners)
    away = np.abs(points - left.center) - 0.5 * np.array(left.size)
    assert away.max() < 1e-9
    assert np.abs(away).min(axis=0).max() < 1e-9  # it touches all six faces
    assert left.name == "box"
