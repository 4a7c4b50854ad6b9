import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

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


box = st.tuples(point, st.tuples(*[st.floats(0.01, 0.2)] * 3), st.floats(-4.0, 4.0))


@given(st.lists(box, min_size=1, max_size=4), point)
def test_distances_to_boxes_are_true_but_for_half_a_voxel_and_never_too_large(
    boxes: list[tuple[tuple[float, ...], tuple[float, ...], float]], query: tuple[float, ...]
) -> None:
    centers, sizes = np.array([b[0] for b in boxes]), np.array([b[1] for b in boxes])
    grid = DistanceGrid.of_boxes(centers, sizes, np.array([b[2] for b in boxes]), H, 0.6)
    [value] = grid.at(np.array([query]))
    truth = min(surface_distance(np.array(query), np.array(b[0]), np.array(b[1]), b[2]) for b in boxes)
    assert value <= truth + 1e-6
    assert value >= truth - np.sqrt(3) * H - 1e-6


def surface_distance(query: np.ndarray, center: np.ndarray, size: np.ndarray, yaw: float) -> float:
    """Signed distance to a box; inside it is that to the nearest face."""
    off = np.abs(Rotation.from_euler("z", -yaw).apply(query - center)) - 0.5 * size
    return float(np.linalg.norm(np.maximum(off, 0.0)) + min(off.max(), 0.0))
