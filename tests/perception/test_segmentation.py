import numpy as np
import pytest
from raycast import BLACK, MIDDLE_THIRD, PURPLE, REAR_POSE, RED, WOOD, Block, Cylinder, Sensor, render
from scipy.spatial.transform import RigidTransform

from perception.segmentation import NoSegment, NotSeen, Segment, SegmentationParameters, segment

PARAMETERS = SegmentationParameters.for_color(RED)
PANEL = Block(np.array([0.5, -3.0, -3.0]), np.array([0.6, 3.0, 3.0]), WOOD)


def scene(rear: RigidTransform, color: tuple[float, float, float] = RED) -> list[Cylinder | Block]:
    return [PANEL, Cylinder(rear.apply([0.0, 0.0, 0.75]), np.array([0.0, 1.0, 0.0]), color=color)]


def test_red_takes_two_hue_ranges_and_blue_one() -> None:
    assert [(int(a[0]), int(b[0])) for a, b in PARAMETERS.ranges()] == [(172, 179), (0, 8)]
    assert len(SegmentationParameters.for_color((0.1, 0.3, 0.8)).ranges()) == 1


@pytest.mark.parametrize("light", [0.64, 0.8, 1.0, 1.2])  # 0.64: 20 % less light on an already dim day
def test_the_mask_is_the_connector_in_any_light(light: float) -> None:
    frame = render(scene(REAR_POSE), REAR_POSE, MIDDLE_THIRD, Sensor(light=light, gray_noise=2.0), 3)
    bare = render(scene(REAR_POSE)[1:], REAR_POSE, MIDDLE_THIRD, Sensor(subpixel=0, shadow=False, flying=False), 3)
    truth = bare.depth > 0
    found = segment(frame.rgb, PARAMETERS)
    assert isinstance(found, Segment)
    overlap = np.count_nonzero(found.mask & truth) / np.count_nonzero(found.mask | truth)
    assert overlap > 0.97
    assert found.area == np.count_nonzero(found.mask)
    v, u = np.nonzero(found.mask)
    u0, v0, u1, v1 = found.box
    assert (u0 <= u.min(), u.max() < u1) == (True, True)
    assert (v0 <= v.min(), v.max() < v1) == (True, True)


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


def test_the_larger_of_two_patches_wins_and_small_gaps_close() -> None:
    rgb = np.zeros((80, 120, 3), np.uint8)
    rgb[10:20, 5:35] = (190, 13, 15)
    rgb[40:60, 20:100] = (190, 13, 15)
    rgb[40:60, 60:62] = 0  # a reflection two pixels wide
    found = segment(rgb, PARAMETERS)
    assert isinstance(found, Segment)
    assert (found.area, bool(found.mask[:30].any())) == (20 * 80, False)


def test_what_was_dark_before_stays_out_at_the_rim() -> None:
    rgb = np.zeros((60, 60, 3), np.uint8)
    rgb[20:40, 20:40] = (190, 13, 15)
    found = segment(rgb, PARAMETERS)
    assert isinstance(found, Segment)
    np.testing.assert_array_equal(found.mask, rgb[..., 0] > 0)
