import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from regrasp.motion.scene.distance_grid import FREE_DISTANCE, DistanceGrid

LOWER, UPPER, H = np.array([-0.2, 0.0, 0.1]), np.array([0.2, 0.3, 0.3]), 0.02

point = st.tuples(st.floats(-0.199, 0.199), st.floats(0.001, 0.299), st.floats(0.101, 0.299))


def look_up(grid: DistanceGrid, p: np.ndarray) -> float:
    i, j, k = np.floor((p - grid.lower) / grid.h).astype(int)
    return float(grid.distance[i, j, k])


@given(st.lists(point, min_size=1, max_size=20), point)
def test_never_farther_than_the_nearest_occupied_voxel(
    points: list[tuple[float, ...]], query: tuple[float, ...]
) -> None:
    grid = DistanceGrid.from_points(np.array(points), LOWER, UPPER, H)
    centres = LOWER + (np.floor((np.array(points) - LOWER) / H) + 0.5) * H
    truth = np.linalg.norm(centres - np.array(query), axis=1).min()
    value = look_up(grid, np.array(query))
    assert value <= truth + 1e-6
    assert value >= truth - np.sqrt(3) * H - 1e-6


def test_nothing_occupied_is_far_and_points_outside_are_left_out() -> None:
    empty = DistanceGrid.from_points(np.array([[5.0, 5.0, 5.0]]), LOWER, UPPER, H)
    assert np.all(empty.distance == FREE_DISTANCE)
    assert empty.distance.shape == (20, 15, 10)
    assert empty.distance.dtype == np.float32
