import colorsys

import numpy as np
import pytest
from numpy.typing import NDArray
from raycast import BLACK, MIDDLE_THIRD, PURPLE, REAR_POSE, RED, WOOD, Block, Cylinder, Sensor, render
from scipy.spatial.transform import RigidTransform

from regrasp.perception.camera.color import SegmentationParameters, color_mask
from regrasp.perception.pose.segmentation import NoSegment, NotSeen, Segment, segment

PARAMETERS = SegmentationParameters.for_color(RED)
PANEL = Block(np.array([0.5, -3.0, -3.0]), np.array([0.6, 3.0, 3.0]), WOOD)


def scene(rear: RigidTransform, color: tuple[float, float, float] = RED) -> list[Cylinder | Block]:
    return [PANEL, Cylinder(rear.apply([0.0, 0.0, 0.75]), np.array([0.0, 1.0, 0.0]), color=color)]


def in_image(found: Segment, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    out = np.zeros(shape, np.bool_)
    u, v = found.corner
    out[v : v + found.mask.shape[0], u : u + found.mask.shape[1]] = found.mask
    return out


@pytest.mark.parametrize("color", [(0.75, 0.05, 0.06), (0.75, 0.0, 0.15), (0.75, 0.1, 0.0), (0.1, 0.3, 0.8)])
def test_a_colours_range_holds_hues_as_near_on_either_side(color: tuple[float, float, float]) -> None:
    hue = colorsys.rgb_to_hsv(*color)[0]
    turned = [colorsys.hsv_to_rgb((hue + degrees / 360) % 1.0, 1.0, 0.7) for degrees in range(-90, 91)]
    image = np.array([turned]) * 255
    seen = color_mask(image.round().astype(np.uint8), SegmentationParameters.for_color(color))[0] > 0
    degrees = np.flatnonzero(seen) - 90
    assert (degrees.min(), degrees.max()) == (pytest.approx(-16, abs=2), pytest.approx(16, abs=2))
    assert len(degrees) == np.ptp(degrees) + 1


@pytest.mark.parametrize("light", [0.64, 0.8, 1.0, 1.2])  # 0.64: 20 % less light on an already dim day
def test_the_mask_is_the_connector_in_any_light(light: float) -> None:
    frame = render(scene(REAR_POSE), REAR_POSE, MIDDLE_THIRD, Sensor(light=light, gray_noise=2.0), 3)
    bare = render(scene(REAR_POSE)[1:], REAR_POSE, MIDDLE_THIRD, Sensor(subpixel=0, shadow=False, flying=False), 3)
    truth = bare.depth > 0
    found = segment(frame.rgb, PARAMETERS)
    assert isinstance(found, Segment)
    seen = in_image(found, truth.shape)
    overlap = np.count_nonzero(seen & truth) / np.count_nonzero(seen | truth)
    assert overlap > 0.97
    assert found.area == np.count_nonzero(seen)


def test_in_full_shadow_it_is_still_found() -> None:
    frame = render(
        scene(REAR_POSE), REAR_POSE, MIDDLE_THIRD, Sensor(to_light=(1.0, 0.0, 0.0), light=0.8, gray_noise=2.0), 5
    )
    found = segment(frame.rgb, PARAMETERS)
    assert isinstance(found, Segment)
    assert found.area > 1200


@pytest.mark.parametrize("color", [BLACK, PURPLE, WOOD, (0.1, 0.3, 0.8), (0.8, 0.8, 0.8)])
def test_other_things_of_the_cell_are_not_taken_for_it(color: tuple[float, float, float]) -> None:
    found = segment(render(scene(REAR_POSE, color), REAR_POSE, MIDDLE_THIRD, Sensor(gray_noise=2.0), 1).rgb, PARAMETERS)
    assert isinstance(found, NoSegment)
    assert found.reason is NotSeen.NO_COLOR


def test_a_speck_is_too_small_and_says_how_small() -> None:
    rgb = np.zeros((50, 60, 3), np.uint8)
    rgb[10:14, 20:24] = (190, 13, 15)
    found = segment(rgb, PARAMETERS)
    assert isinstance(found, NoSegment)
    assert (found.reason, "16 pixels" in found.message) == (NotSeen.TOO_SMALL, True)


def test_the_larger_of_two_blobs_wins_and_small_gaps_close() -> None:
    rgb = np.zeros((80, 120, 3), np.uint8)
    rgb[10:20, 5:35] = (190, 13, 15)
    rgb[40:60, 20:100] = (190, 13, 15)
    rgb[40:60, 60:62] = 0  # a reflection two pixels wide
    found = segment(rgb, PARAMETERS)
    assert isinstance(found, Segment)
    assert (found.area, bool(in_image(found, (80, 120))[:30].any())) == (20 * 80, False)


def test_what_was_dark_before_stays_out_at_the_rim() -> None:
    rgb = np.zeros((60, 60, 3), np.uint8)
    rgb[20:40, 20:40] = (190, 13, 15)
    found = segment(rgb, PARAMETERS)
    assert isinstance(found, Segment)
    np.testing.assert_array_equal(in_image(found, (60, 60)), rgb[..., 0] > 0)
