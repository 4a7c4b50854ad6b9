from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray
from raycast import CONNECTOR, MIDDLE_THIRD, PURPLE, REAR_POSE, WOOD, Block, Cylinder, Sensor, render
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.frame import Intrinsics, RgbdFrame
from regrasp.perception.pose.estimate import Estimate, NoEstimate
from regrasp.perception.pose.rgbd import Rgbd, RgbdParameters, min_max_axis, n_mean
from regrasp.perception.pose.segmentation import NotSeen

Vector = NDArray[np.float64]
EYE = RigidTransform.identity()  # the camera's optical frame is the world
known = SimpleNamespace(cable=SimpleNamespace(connector=CONNECTOR))
estimate = Rgbd(cast(CableKnown, known)).estimate
MIDDLE = np.array([0.0, 0.0, 0.75])


def wall(z: float = 0.87) -> Block:
    return Block(np.array([-3.0, -3.0, z]), np.array([3.0, 3.0, z + 0.1]), WOOD)


def view(axis: Vector, camera: Intrinsics, seed: int, *others: Block, sensor: Sensor | None = None) -> RgbdFrame:
    return render([wall(), Cylinder(MIDDLE, axis), *others], EYE, camera, sensor or Sensor(), seed)


def tilted(degrees_in_image: float, degrees_to_camera: float) -> Vector:
    turn = Rotation.from_euler("ZY", [degrees_in_image, degrees_to_camera], degrees=True)
    return turn.apply([1.0, 0.0, 0.0])


def errors(result: Estimate | NoEstimate, axis: Vector) -> tuple[float, float, float]:
    """Metres along and square to the axis, and degrees."""
    assert isinstance(result, Estimate)
    offset = result.position - MIDDLE
    along = float(offset @ axis)
    angle = float(np.rad2deg(np.arccos(min(1.0, abs(float(result.axis @ axis))))))
    return abs(along), float(np.linalg.norm(offset - along * axis)), angle


def test_it_finds_the_front_and_its_axis_roughly() -> None:
    axis = tilted(10.0, 0.0)
    frames = [view(axis, MIDDLE_THIRD, seed) for seed in range(10)]
    along, across, angle = np.array([errors(estimate(f, EYE), axis) for f in frames]).mean(axis=0)
    assert along < 0.005
    assert 0.006 < across < 0.010  # the surface is sqrt(3)/2 of the radius before the axis
    assert angle < 12.0


@pytest.mark.parametrize("share", [0.3, 0.5])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_hidden_part_draws_it_to_the_visible_part_s_middle(share: float, side: int) -> None:
    cut = side * 0.09 * (0.5 - share) * 0.65 / 0.75
    low, high = min(cut, side * 0.12), max(cut, side * 0.12)
    block = Block(np.array([low, -0.2, 0.65]), np.array([high, 0.2, 0.70]), PURPLE)
    axis = tilted(0.0, 15.0)
    visible = np.array([errors(estimate(view(axis, MIDDLE_THIRD, seed, block), EYE), axis) for seed in range(8)])
    assert np.median(visible[:, 0]) > 0.4 * share * 0.09


def test_the_sign_follows_the_hint_or_world_left() -> None:
    axis = np.array([1.0, 0.0, 0.0])
    frame = view(axis, MIDDLE_THIRD, 3)
    for hint in (axis, -axis):
        result = estimate(frame, EYE, axis=hint)
        assert isinstance(result, Estimate)
        assert result.axis @ hint > 0.99
    upright = estimate(view(np.array([0.0, 1.0, 0.0]), MIDDLE_THIRD, 3), EYE)
    assert isinstance(upright, Estimate)
    assert upright.axis[1] > 0.99


def test_world_pose_does_not_depend_on_where_the_camera_stands() -> None:
    things: list[Cylinder | Block] = [wall(), Cylinder(MIDDLE, tilted(20.0, 30.0))]
    here = estimate(render(things, EYE, MIDDLE_THIRD, Sensor(), 5), EYE, axis=np.array([1.0, 0.0, 0.0]))
    assert isinstance(here, Estimate)
    there = estimate(
        render(things, EYE, MIDDLE_THIRD, Sensor(), 5), REAR_POSE, axis=REAR_POSE.rotation.apply([1.0, 0, 0])
    )
    assert isinstance(there, Estimate)
    np.testing.assert_allclose(there.position, REAR_POSE.apply(here.position), atol=1e-9)
    np.testing.assert_allclose(there.axis, REAR_POSE.rotation.apply(here.axis), atol=1e-9)
    np.testing.assert_allclose(there.world_from_connector.rotation.apply([1.0, 0.0, 0.0]), there.axis, atol=1e-9)
    np.testing.assert_allclose(there.world_from_connector.translation, there.position, atol=1e-9)
    assert there.world_from_connector.rotation.apply([0.0, 0.0, 1.0])[2] > 0.5  # upright as the camera


def test_reasons_are_named() -> None:
    empty = estimate(render([wall()], EYE, MIDDLE_THIRD, Sensor(), 1), EYE)
    assert isinstance(empty, NoEstimate)
    assert empty.reason is NotSeen.NO_COLOR
    seen = view(np.array([1.0, 0.0, 0.0]), MIDDLE_THIRD, 1)
    blind = RgbdFrame("rear", 1, 0.5, seen.rgb, np.zeros_like(seen.depth), seen.intrinsics)
    result = estimate(blind, EYE)
    assert isinstance(result, NoEstimate)
    assert (result.reason, result.stamp) == (NotSeen.NO_DEPTH, 0.5)


def test_holes_and_bad_values_in_the_depth_do_no_harm() -> None:
    axis = tilted(30.0, 20.0)
    frame = view(axis, MIDDLE_THIRD, 9)
    rng = np.random.default_rng(0)
    depth = frame.depth.copy()
    depth[rng.random(depth.shape) < 0.3] = 0.0
    depth[rng.random(depth.shape) < 0.05] = np.nan
    depth[rng.random(depth.shape) < 0.02] += 0.3
    spoilt = RgbdFrame("rear", 1, 0.0, frame.rgb, depth, frame.intrinsics)
    along, across, angle = errors(estimate(spoilt, EYE), axis)
    assert (along < 0.01, across < 0.015, angle < 25.0) == (True, True, True), (along, across, angle)


def test_n_mean_and_min_max_by_hand() -> None:
    points = np.column_stack([np.arange(11.0), np.zeros(11), np.r_[np.full(5, 1.0), np.full(6, 2.0)]])
    np.testing.assert_allclose(
        n_mean(points, RgbdParameters.middle_share), [4.5, 0.0, 1.5]
    )  # n = 2: the fifth and sixth of eleven
    np.testing.assert_allclose(
        min_max_axis(points, RgbdParameters.end_share), np.array([10.0, 0.0, 1.0]) / np.sqrt(101.0)
    )
