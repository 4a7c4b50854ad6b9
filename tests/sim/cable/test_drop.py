"""The drop of a lost end: where it hangs by itself, and that obstacles stop it."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.cell import Box, pose_along
from regrasp.interfaces.scene import Gravity, Obstacle
from regrasp.sim.cable.drop import DropParameters, settled_end

LOST_AT = pose_along((0.38, 0.10, 0.36), (0.0, 0.9, 0.4))


def block(center: tuple[float, float, float], size: tuple[float, float, float]) -> Obstacle:
    return Obstacle(Box(name="block", center=center, size=size), 0.0, None)


def settled(cell: CableCell, gravity: Gravity, *obstacles: Obstacle) -> RigidTransform:
    end = settled_end(cell, gravity, obstacles, LOST_AT)
    assert end is not None
    rear = end.connector.apply([-0.5 * cell.known.cable.connector.length, 0.0, 0.0])
    np.testing.assert_allclose(end.cable[-1], rear)
    np.testing.assert_allclose(end.cable[0], cell.hidden.cable.anchor, atol=1e-6)
    lengths = np.linalg.norm(np.diff(end.cable, axis=0), axis=1)
    np.testing.assert_allclose(lengths, cell.hidden.cable.length / cell.hidden.cable.links, rtol=0.02)
    return end.connector


def test_without_gravity_the_free_end_is_straight(cell: CableCell) -> None:
    at = settled(cell, "zero")
    cable = cell.hidden.cable
    x, y, z = cable.anchor
    straight = [x, y + cable.length + 0.5 * cell.known.cable.connector.length, z]
    np.testing.assert_allclose(at.translation, straight, atol=0.006)
    assert at.rotation.apply([1.0, 0.0, 0.0])[1] > 0.999


def test_on_earth_it_droops(cell: CableCell) -> None:
    droop = cell.hidden.cable.anchor[2] - settled(cell, "earth").translation[2]
    assert 0.10 < droop < 0.18  # the cell file says 0.14


def test_a_block_under_it_holds_it_up_and_one_beside_it_does_nothing(cell: CableCell) -> None:
    free = settled(cell, "earth").translation
    beside = settled(cell, "earth", block((0.15, 0.12, 0.10), (0.08, 0.12, 0.20))).translation
    np.testing.assert_allclose(beside, free, atol=1e-3)
    top = 0.16
    on = settled(cell, "earth", block((0.36, 0.10, 0.5 * top), (0.16, 0.12, top))).translation
    assert on[2] > top
    assert on[2] > free[2] + 0.05


def test_a_block_where_the_straight_cable_was_is_no_way_in(cell: CableCell) -> None:
    """The end is laid through blocks, and lost above them."""
    top = 0.30
    on = settled(cell, "zero", block((0.36, 0.10, 0.5 * top), (0.12, 0.12, top))).translation
    assert on[2] > top or abs(on[0] - 0.36) > 0.06


def test_an_end_that_goes_on_swinging_has_not_settled(cell: CableCell) -> None:
    assert settled_end(cell, "zero", (), LOST_AT, DropParameters(max_seconds=1.0)) is None


@pytest.mark.parametrize("gravity", ["zero", "earth"])
def test_the_same_drop_ends_the_same(cell: CableCell, gravity: Gravity) -> None:
    first, again = (settled(cell, gravity).as_matrix() for _ in range(2))
    assert np.array_equal(first, again)
