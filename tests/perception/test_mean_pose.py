import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from perception.estimate import Estimate
from perception.mean_pose import mean_pose

PLACE, LEFT = np.array([0.4, 0.1, 0.3]), np.array([0.0, 1.0, 0.0])


def estimate(
    position: NDArray[np.float64] = PLACE, axis: NDArray[np.float64] = LEFT, extent: float = 0.09, whole: bool = True
) -> Estimate:
    return Estimate(
        0.0, "rear", position, axis, RigidTransform.from_translation(position), np.eye(6), 500, 600, extent, whole
    )


def test_one_false_look_moves_nothing() -> None:
    looks = [estimate(np.add(PLACE, [0, 0, 1e-3 * i])) for i in (-1, 0, 1)]
    pose, whole = mean_pose([*looks, estimate(np.add(PLACE, [0.3, 0, 0])), estimate(PLACE)])
    assert whole
    assert pose.translation == pytest.approx(PLACE, abs=1e-3)


def test_parts_do_not_count_beside_a_look_at_the_whole() -> None:
    part = estimate(np.add(PLACE, [0.0, 0.03, 0.0]), extent=0.03, whole=False)
    pose, whole = mean_pose([part, part, part, estimate()])
    assert whole
    assert pose.translation == pytest.approx(PLACE)


def test_of_parts_alone_the_longest_count_and_are_not_the_whole() -> None:
    stub = estimate(np.add(PLACE, [0.0, 0.04, 0.0]), axis=np.array([1.0, 0.0, 0.0]), extent=0.02, whole=False)
    pose, whole = mean_pose([stub, stub, stub, estimate(extent=0.06, whole=False)])
    assert not whole
    assert pose.translation == pytest.approx(PLACE)
    assert pose.rotation.apply([1.0, 0.0, 0.0]) == pytest.approx(LEFT)


def test_noise_of_the_axis_averages_out() -> None:
    rng = np.random.default_rng(0)
    turns = Rotation.from_rotvec(rng.normal(0, np.deg2rad(4), (40, 3)))
    pose, _ = mean_pose([estimate(axis=turn.apply(LEFT)) for turn in turns])
    angle = np.rad2deg(np.arccos(pose.rotation.apply([1.0, 0.0, 0.0]) @ LEFT))
    assert angle < 2.0


@given(st.tuples(*[st.floats(-1, 1)] * 3), st.tuples(*[st.floats(-1, 1)] * 3))
def test_one_estimate_is_its_own_mean(position: tuple[float, ...], direction: tuple[float, ...]) -> None:
    axis = np.array(direction)
    if np.linalg.norm(axis) < 0.1:
        return
    axis /= np.linalg.norm(axis)
    pose, _ = mean_pose([estimate(np.array(position), axis)])
    assert pose.translation == pytest.approx(np.array(position))
    assert pose.rotation.apply([1.0, 0.0, 0.0]) == pytest.approx(axis, abs=1e-9)


def test_no_estimate_has_no_mean() -> None:
    with pytest.raises(ValueError, match="no estimate"):
        mean_pose([])
