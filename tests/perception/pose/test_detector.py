import dataclasses
from importlib.resources import files

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from raycast import PURPLE, WOOD, Block, Cylinder, Sensor, render
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.frame import Intrinsics, RgbdFrame
from regrasp.perception.camera.model import project
from regrasp.perception.detection import intersection_over_union, letterboxed
from regrasp.perception.pose.detector import (
    MIN_PIXEL_SIZE,
    NETWORK_HEIGHT,
    NETWORK_WIDTH,
    Detector,
    DetectorParameters,
    decode,
    network_input,
    pixel_sizes,
)
from regrasp.perception.pose.estimate import Estimate, NoEstimate
from regrasp.perception.pose.segmentation import NotSeen

EYE = RigidTransform.identity()  # the camera's optical frame is the world
MIDDLE = np.array([0.0, 0.0, 0.75])
K = Intrinsics.from_fov(848, 480, np.deg2rad(65.0))
coordinates = st.floats(-50, 50)
boxes = st.tuples(coordinates, coordinates, st.floats(0.1, 40), st.floats(0.1, 40)).map(
    lambda b: (b[0], b[1], b[0] + b[2], b[1] + b[3])
)


@pytest.fixture(scope="module")
def detector(known: CableKnown) -> Detector:
    return Detector(known)


def wall() -> Block:
    return Block(np.array([-3.0, -3.0, 0.87]), np.array([3.0, 3.0, 0.97]), WOOD)


def axis_at(degrees: float) -> NDArray[np.float64]:
    return Rotation.from_euler("z", degrees, degrees=True).apply([1.0, 0.0, 0.0])


def view(*things: Cylinder | Block, seed: int = 1, k: Intrinsics = K) -> RgbdFrame:
    cable = [
        Cylinder(thing.center - 0.145 * thing.axis, thing.axis, radius=0.0035, length=0.2, color=(0.06, 0.06, 0.06))
        for thing in things
        if isinstance(thing, Cylinder)
    ]
    return render([wall(), *things, *cable], EYE, k, Sensor(), seed)


def test_the_shipped_network_is_small() -> None:
    assert len(files("regrasp.perception.pose").joinpath("detector.onnx").read_bytes()) < 2 * 1024 * 1024


@pytest.mark.parametrize("degrees", [0.0, 30.0, 75.0, 120.0, 165.0])
def test_box_and_angle_of_a_free_connector(detector: Detector, degrees: float) -> None:
    thing = Cylinder(MIDDLE, axis_at(degrees))
    found = detector.detect(view(thing))
    assert len(found) == 1
    ends = project(MIDDLE + np.outer([-0.045, 0.045], thing.axis), K)
    side = 0.010 / 0.75 * K.fx * np.abs(axis_at(degrees + 90))[:2]
    u0, v0, u1, v1 = np.concatenate([ends.min(axis=0) - side, ends.max(axis=0) + side]).tolist()
    assert intersection_over_union(found[0].box, (u0, v0, u1, v1)) > 0.5
    assert abs((np.rad2deg(found[0].angle) - degrees + 90) % 180 - 90) < 12
    assert found[0].in_plane > 0.8


@pytest.mark.parametrize("size", [(640, 480), (848, 480), (1280, 720), (424, 240)])
def test_pictures_of_any_size(detector: Detector, size: tuple[int, int]) -> None:
    k = Intrinsics.from_fov(*size, np.deg2rad(65.0))
    found = detector.detect(view(Cylinder(MIDDLE, axis_at(20.0)), k=k))
    assert len(found) == 1
    middle = np.array(found[0].center)
    assert np.linalg.norm(middle - [k.cx, k.cy]) < 0.015 / 0.75 * k.fx


def test_the_pose_is_that_of_the_front_of_the_visible_part(detector: Detector) -> None:
    for degrees in (0.0, 40.0, 100.0):
        result = detector.estimate(view(Cylinder(MIDDLE, axis_at(degrees))), EYE, axis=axis_at(degrees))
        assert isinstance(result, Estimate)
        assert np.linalg.norm(result.position - MIDDLE) < 0.02
        assert result.position[2] < MIDDLE[2]  # the surface, as in the thesis
        assert np.rad2deg(np.arccos(result.axis @ axis_at(degrees))) < 20
        assert np.allclose(result.world_from_connector.rotation.apply([1.0, 0.0, 0.0]), result.axis)


def test_where_few_readings_are_the_axis_is_the_networks_own(detector: Detector) -> None:
    frame = view(Cylinder(MIDDLE, axis_at(30.0)))
    u, v = detector.detect(frame)[0].center
    depth = np.zeros_like(frame.depth)
    few = np.s_[round(v) - 1 : round(v) + 2, round(u) - 1 : round(u) + 2]
    depth[few] = frame.depth[few]
    borrowed, own = (
        detector.estimate(f, EYE, axis=axis_at(30.0)) for f in (frame, dataclasses.replace(frame, depth=depth))
    )
    assert isinstance(borrowed, Estimate)
    assert isinstance(own, Estimate)
    assert own.axis[2] == 0.0
    assert np.rad2deg(np.arccos(own.axis @ axis_at(30.0))) < 12
    assert np.trace(own.covariance[3:, 3:]) > np.trace(borrowed.covariance[3:, 3:])


def test_what_has_another_colour_than_the_cells_connector_is_not_it(known: CableKnown) -> None:
    blue = known.with_cable(connector=known.cable.connector.model_copy(update={"color": (0.1, 0.1, 0.9)}))
    frame = view(Cylinder(MIDDLE, axis_at(30.0)))
    assert Detector(blue).detect(frame) == []
    result = Detector(blue).estimate(frame, EYE)
    assert isinstance(result, NoEstimate)
    assert result.reason is NotSeen.NO_COLOR


def test_of_two_the_one_near_the_last_place_is_taken(detector: Detector) -> None:
    places = [np.array([x, 0.0, 0.75]) for x in (-0.2, 0.2)]
    frame = view(*(Cylinder(place, axis_at(20.0)) for place in places))
    for place in places:
        result = detector.estimate(frame, EYE, near=place)
        assert isinstance(result, Estimate)
        assert np.linalg.norm(result.position - place) < 0.03


def test_reasons_have_names_and_numbers(detector: Detector) -> None:
    nothing = detector.estimate(view(), EYE)
    assert isinstance(nothing, NoEstimate)
    assert nothing.reason == NotSeen.LOW_SCORE
    assert str(DetectorParameters().min_score) in nothing.message
    frame = view(Cylinder(MIDDLE, axis_at(0.0)))
    blind = detector.estimate(dataclasses.replace(frame, depth=np.zeros_like(frame.depth)), EYE)
    assert isinstance(blind, NoEstimate)
    assert blind.reason == NotSeen.NO_DEPTH


@settings(max_examples=40)
@given(
    value=st.sampled_from([0.0, np.nan, np.inf, -np.inf, -1.0, 1e30, 0.75]),
    rgb=st.sampled_from(["black", "white", "red", "noise", "scene"]),
    share=st.floats(0, 1),
    seed=st.integers(0, 99),
)
def test_broken_frames_give_a_reason_or_an_honest_pose(
    detector: Detector, value: float, rgb: str, share: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    frame = view(Cylinder(MIDDLE, axis_at(25.0)))
    plain = {"black": (0, 0, 0), "white": (255, 255, 255), "red": (190, 13, 15)}
    picture = frame.rgb if rgb == "scene" else rng.integers(0, 256, frame.rgb.shape, np.uint8)
    if rgb in plain:
        picture = np.full_like(frame.rgb, plain[rgb])
    depth = np.where(rng.random(frame.depth.shape) < share, np.float32(value), frame.depth).astype(np.float32)
    result = detector.estimate(dataclasses.replace(frame, rgb=picture, depth=depth), EYE)
    if isinstance(result, NoEstimate):
        assert result.message
        return
    assert np.isfinite(result.position).all()
    assert np.isfinite(result.covariance).all()
    error = result.position - MIDDLE
    deviation = np.sqrt(np.diag(result.covariance)[:3])
    assert rgb == "scene"
    assert (np.abs(error) < 4 * deviation).all()


def test_maps_are_read_as_they_are_written() -> None:
    maps = np.zeros((7, 30, 54), np.float32)
    maps[:, 20, 30] = [0.9, 0.25, -0.5, np.log(6.0), np.log(3.0), 0.49 * np.cos(1.0), 0.49 * np.sin(1.0)]
    maps[:, 20, 32] = [0.8, -1.75, -0.5, np.log(6.0), np.log(3.0), 1.0, 0.0]  # the same box again
    maps[:, 25, 50] = [0.2, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]
    found = decode(maps, 0.5, 0.1)
    assert [round(d.score, 3) for d in found] == [0.9, 0.2]
    assert found[0].center == pytest.approx((30.75 * 8 / 0.5 - 0.5, 20.0 * 8 / 0.5 - 0.5))
    assert found[0].size == pytest.approx((6 * 16, 3 * 16), rel=1e-5)
    assert (found[0].angle, found[0].in_plane) == pytest.approx((0.5, 0.7), rel=1e-5)


def test_a_box_elsewhere_counts_though_its_cell_is_next_to_a_likelier_one() -> None:
    maps = np.zeros((7, 30, 54), np.float32)
    maps[0, 10, 20:23] = 0.9, 0.8, 0.7
    maps[1, 10, 20:23] = 0.0, -1.0, 2.0  # the second's box is the first's, the third's is none of them
    assert [round(d.score, 3) for d in decode(maps, 1.0, 0.5)] == [0.9, 0.7]
    assert decode(maps, 1.0, 0.95) == []


def test_a_picture_is_shrunk_without_a_change_of_shape() -> None:
    rgb = np.zeros((480, 640, 3), np.uint8)
    cv2.circle(rgb, (320, 240), 100, (255, 255, 255), -1)
    small, scale = letterboxed(rgb, (NETWORK_HEIGHT, NETWORK_WIDTH))
    assert small.shape == (240, 432, 3)
    assert scale == 0.5
    _, _, width, height = cv2.boundingRect((small[..., 0] > 127).astype(np.uint8))
    assert abs(width - height) <= 1
    assert width == pytest.approx(100, abs=1.5)


@given(st.floats(0.2, 5.0), st.sampled_from([(640, 480), (848, 480), (432, 240), (320, 240)]), st.floats(40.0, 90.0))
def test_a_pixel_of_the_input_shows_as_much_as_geometry_says(z: float, size: tuple[int, int], fov: float) -> None:
    k = Intrinsics.from_fov(*size, np.deg2rad(fov))
    sizes = pixel_sizes(np.full(size[::-1], z, np.float32), k)
    assert sizes.shape == (120, 216)
    _, scale = letterboxed(np.zeros(size[::-1], np.uint8), (NETWORK_HEIGHT, NETWORK_WIDTH))
    assert sizes.max() * scale / 2 * size[0] == pytest.approx(2 * z * np.tan(np.deg2rad(fov) / 2), rel=1e-5)
    given_to_network = network_input(np.zeros((240, 432, 3), np.uint8), sizes)[12]
    assert given_to_network.max() == pytest.approx(max(0, np.log(sizes.max() / MIN_PIXEL_SIZE) / 2), abs=1e-5)


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf, 1e30])
def test_what_is_no_reading_has_no_size(value: float) -> None:
    depth = np.full((480, 848), 0.5, np.float32)
    depth[100:200] = value
    sizes = pixel_sizes(depth, K)
    assert not sizes[26:49].any()
    seen = network_input(np.zeros((240, 432, 3), np.uint8), sizes)
    assert np.isfinite(seen).all()
    assert not seen[:, 26:49].any()
    assert seen[12, :25, :200].all()


def test_the_network_sees_every_pixel_once() -> None:
    rng = np.random.default_rng(0)
    image, sizes = rng.integers(0, 256, (240, 432, 3), np.uint8), rng.uniform(1e-4, 1e-2, (120, 216)).astype(np.float32)
    seen = network_input(image, sizes)
    for k, (down, right) in enumerate([(0, 0), (0, 1), (1, 0), (1, 1)]):
        assert seen[3 * k : 3 * k + 3] == pytest.approx(image[down::2, right::2].transpose(2, 0, 1) / 255, abs=1e-6)
    assert seen[12] == pytest.approx(np.log(np.maximum(sizes, MIN_PIXEL_SIZE) / MIN_PIXEL_SIZE) / 2, abs=1e-5)


def test_size_tells_the_connector_from_a_large_likeness(detector: Detector) -> None:
    """The same picture, pixel by pixel, is the connector at 0.75 m and a thing of 0.3 m at 2.5 m."""
    frame = view(Cylinder(MIDDLE, axis_at(20.0)))
    far = dataclasses.replace(frame, depth=frame.depth * np.float32(2.5 / 0.75))
    assert detector.detect(frame)
    assert not detector.detect(far)


@given(boxes, boxes)
def test_overlap_is_a_share_and_symmetric(a: tuple[float, ...], b: tuple[float, ...]) -> None:
    share = intersection_over_union(a, b)  # type: ignore[arg-type]
    assert 0 <= share <= 1
    assert share == pytest.approx(intersection_over_union(b, a))  # type: ignore[arg-type]
    assert intersection_over_union(a, a) == pytest.approx(1.0)  # type: ignore[arg-type]


def test_boxes_without_area_do_not_overlap() -> None:
    assert intersection_over_union((1.0, 1.0, 1.0, 1.0), (1.0, 1.0, 1.0, 1.0)) == 0.0


def test_another_red_thing_is_no_connector(detector: Detector) -> None:
    red = Block(np.array([-0.04, -0.05, 0.7]), np.array([0.05, 0.05, 0.8]), (0.75, 0.05, 0.06))
    purple = Block(np.array([0.15, -0.1, 0.6]), np.array([0.3, 0.1, 0.7]), PURPLE)
    assert detector.detect(view(red, purple)) == []
