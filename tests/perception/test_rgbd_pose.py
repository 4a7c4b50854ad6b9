import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from raycast import CONNECTOR, IDEAL, MIDDLE_THIRD, PURPLE, REAR_POSE, WOOD, Block, Cylinder, Sensor, render
from scipy.spatial.transform import RigidTransform, Rotation

from interfaces.frame import Intrinsics, RgbdFrame
from perception.estimate import Estimate, NoEstimate
from perception.rgbd_pose import estimate, min_max_axis, n_mean, refine_axis_and_center
from perception.segmentation import NotSeen

Vector = NDArray[np.float64]
EYE = RigidTransform.identity()  # the camera's optical frame is the world
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


@pytest.mark.parametrize("in_image", [0.0, 35.0, 90.0, 140.0])
@pytest.mark.parametrize("to_camera", [-60.0, -25.0, 0.0, 40.0])
def test_a_free_connector_is_found_to_millimetres(in_image: float, to_camera: float) -> None:
    axis = tilted(in_image, to_camera)
    result = estimate(view(axis, MIDDLE_THIRD, 7), EYE, CONNECTOR)
    along, across, angle = errors(result, axis)
    assert (along < 0.005, across < 0.0025, angle < 5.0) == (True, True, True), (along, across, angle)
    assert isinstance(result, Estimate)
    assert result.extent == pytest.approx(0.09, abs=0.010)
    assert result.whole


def test_the_thesiss_method_finds_the_front_and_ours_the_middle() -> None:
    axis = tilted(10.0, 0.0)
    frames = [view(axis, MIDDLE_THIRD, seed) for seed in range(10)]
    faithful = np.array([errors(estimate(f, EYE, CONNECTOR, faithful=True), axis) for f in frames]).mean(axis=0)
    ours = np.array([errors(estimate(f, EYE, CONNECTOR), axis) for f in frames]).mean(axis=0)
    assert 0.006 < faithful[1] < 0.010  # the surface is sqrt(3)/2 of the radius before the axis
    assert ours[1] < 0.0012
    assert ours[2] < 2.0 < faithful[2] < 12.0


@pytest.mark.parametrize("share", [0.3, 0.5])
@pytest.mark.parametrize("side", [-1, 1])
def test_the_end_in_sight_and_the_length_give_the_whole(share: float, side: int) -> None:
    cut = side * 0.09 * (0.5 - share) * 0.65 / 0.75
    low, high = min(cut, side * 0.12), max(cut, side * 0.12)
    block = Block(np.array([low, -0.2, 0.65]), np.array([high, 0.2, 0.70]), PURPLE)
    axis = tilted(0.0, 15.0)
    frames = [view(axis, MIDDLE_THIRD, seed, block) for seed in range(8)]
    whole = np.array([errors(estimate(f, EYE, CONNECTOR), axis) for f in frames])
    visible = np.array([errors(estimate(f, EYE, CONNECTOR, faithful=True), axis) for f in frames])
    assert np.median(whole[:, 0]) < 0.006
    assert np.median(visible[:, 0]) > 0.4 * share * 0.09  # it knows no length and takes the visible part's middle


def test_both_ends_hidden_leaves_the_visible_middle_and_says_so() -> None:
    blocks = [Block(np.array([x, -0.2, 0.65]), np.array([x + 0.1, 0.2, 0.7]), PURPLE) for x in (-0.12, 0.02)]
    result = estimate(view(np.array([1.0, 0.0, 0.0]), MIDDLE_THIRD, 1, *blocks), EYE, CONNECTOR)
    assert isinstance(result, Estimate)
    assert not result.whole
    assert 0.02 < result.extent < 0.05


def test_at_the_image_border_the_length_gives_the_centre() -> None:
    half = Intrinsics(200, 200, 665.6, 665.6, 0.0, 100.0)  # the connector's left half lies outside
    axis = np.array([1.0, 0.0, 0.0])
    result = estimate(view(axis, half, 2), EYE, CONNECTOR)
    along, across, _ = errors(result, axis)
    assert (along < 0.005, across < 0.003) == (True, True)


def test_the_sign_follows_the_hint_or_world_left() -> None:
    axis = np.array([1.0, 0.0, 0.0])
    frame = view(axis, MIDDLE_THIRD, 3)
    for hint in (axis, -axis):
        result = estimate(frame, EYE, CONNECTOR, hint=hint)
        assert isinstance(result, Estimate)
        assert result.axis @ hint > 0.99
    upright = estimate(view(np.array([0.0, 1.0, 0.0]), MIDDLE_THIRD, 3), EYE, CONNECTOR)
    assert isinstance(upright, Estimate)
    assert upright.axis[1] > 0.99


def test_world_pose_does_not_depend_on_where_the_camera_stands() -> None:
    things: list[Cylinder | Block] = [wall(), Cylinder(MIDDLE, tilted(20.0, 30.0))]
    here = estimate(render(things, EYE, MIDDLE_THIRD, Sensor(), 5), EYE, CONNECTOR, hint=np.array([1.0, 0.0, 0.0]))
    assert isinstance(here, Estimate)
    there = estimate(
        render(things, EYE, MIDDLE_THIRD, Sensor(), 5), REAR_POSE, CONNECTOR, hint=REAR_POSE.rotation.apply([1.0, 0, 0])
    )
    assert isinstance(there, Estimate)
    np.testing.assert_allclose(there.position, REAR_POSE.apply(here.position), atol=1e-9)
    np.testing.assert_allclose(there.axis, REAR_POSE.rotation.apply(here.axis), atol=1e-9)
    np.testing.assert_allclose(there.world_from_connector.rotation.apply([1.0, 0.0, 0.0]), there.axis, atol=1e-9)
    np.testing.assert_allclose(there.world_from_connector.translation, there.position, atol=1e-9)
    assert there.world_from_connector.rotation.apply([0.0, 0.0, 1.0])[2] > 0.5  # upright as the camera


def test_reasons_are_named() -> None:
    empty = estimate(render([wall()], EYE, MIDDLE_THIRD, Sensor(), 1), EYE, CONNECTOR)
    assert isinstance(empty, NoEstimate)
    assert empty.reason is NotSeen.NO_COLOR
    seen = view(np.array([1.0, 0.0, 0.0]), MIDDLE_THIRD, 1)
    blind = RgbdFrame("rear", 1, 0.5, seen.rgb, np.zeros_like(seen.depth), seen.intrinsics)
    result = estimate(blind, EYE, CONNECTOR)
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
    along, across, angle = errors(estimate(spoilt, EYE, CONNECTOR), axis)
    assert (along < 0.006, across < 0.003, angle < 5.0) == (True, True, True), (along, across, angle)


@settings(max_examples=50, deadline=None)
@given(st.floats(-180, 180), st.floats(-70, 70), st.floats(0.25, 1.0))
def test_the_fit_is_exact_on_exact_surfaces(in_image: float, to_camera: float, z: float) -> None:
    axis, center = tilted(in_image, to_camera), np.array([0.05, -0.03, z])
    s, turn = (a.ravel() for a in np.meshgrid(np.linspace(-0.045, 0.045, 40), np.linspace(0, 2 * np.pi, 60)))
    across = np.cross(axis, [0.3, 1.0, 0.2])
    across /= np.linalg.norm(across)
    normal = np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * np.cross(axis, across)
    points = center + s[:, None] * axis + 0.01 * normal
    front = points[np.einsum("ij,ij->i", points, normal) < 0]
    found, found_axis = refine_axis_and_center(front, 0.01)
    offset = found - center
    assert np.linalg.norm(offset - (offset @ axis) * axis) < 2e-4
    assert abs(found_axis @ axis) > np.cos(np.deg2rad(0.5))


def test_n_mean_and_min_max_by_hand() -> None:
    points = np.column_stack([np.arange(11.0), np.zeros(11), np.r_[np.full(5, 1.0), np.full(6, 2.0)]])
    np.testing.assert_allclose(n_mean(points), [4.5, 0.0, 1.5])  # n = 2: the fifth and sixth of eleven
    np.testing.assert_allclose(min_max_axis(points), np.array([10.0, 0.0, 1.0]) / np.sqrt(101.0))


def test_ideal_images_leave_a_millimetre() -> None:
    axis = tilted(25.0, -30.0)
    along, across, angle = errors(estimate(view(axis, MIDDLE_THIRD, 0, sensor=IDEAL), EYE, CONNECTOR), axis)
    assert (along < 0.0015, across < 0.0005, angle < 0.7) == (True, True, True), (along, across, angle)
