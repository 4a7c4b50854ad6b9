import numpy as np
import pytest
from numpy.typing import NDArray

from regrasp.perception.pose.fused.silhouette import Silhouette, find_silhouette

BODY, WALL, NEAR = 0.75, 0.87, 0.65  # m
SHIFT = 665.6 * 0.055
Image = NDArray[np.float32]
Mask = NDArray[np.bool_]


def scene() -> tuple[Mask, Image]:
    """A blob of 80 x 20 pixels before a wall, (60, 160), without a shadow."""
    mask = np.zeros((60, 160), bool)
    mask[20:40, 40:120] = True
    return mask, np.where(mask, np.float32(BODY), np.float32(WALL))


def side(found: Silhouette, u: float) -> NDArray[np.bool_]:
    """`occluded` of the upright edge at `u`, without its corners."""
    pixels = found.pixels
    return found.occluded[(np.abs(pixels[:, 0] - u) < 0.1) & (pixels[:, 1] > 22) & (pixels[:, 1] < 37)]


def test_a_free_blob_has_its_whole_silhouette_in_sight() -> None:
    mask, depth = scene()
    found = find_silhouette(mask, depth, SHIFT)
    assert len(found.pixels) == 2 * (80 + 20)
    assert not found.occluded.any()
    assert found.pixels.min(axis=0) == pytest.approx([39.5, 19.5])  # halfway between the blob and its neighbours
    assert found.pixels.max(axis=0) == pytest.approx([119.5, 39.5])


@pytest.mark.parametrize("right", [True, False])
def test_an_edge_behind_a_nearer_thing_is_occluded(right: bool) -> None:
    mask, depth = scene()
    columns = np.s_[90:] if right else np.s_[:70]
    mask[:, columns], depth[:, columns] = False, NEAR
    found = find_silhouette(mask, depth, SHIFT)
    hidden, free = (89.5, 39.5) if right else (69.5, 119.5)
    assert side(found, hidden).all()
    assert not side(found, free).any()


def test_its_own_shadow_occludes_nothing() -> None:
    mask, depth = scene()
    width = round(SHIFT * (1 / BODY - 1 / WALL))
    depth[20:40, 40 - width : 40] = 0.0
    found = find_silhouette(mask, depth, SHIFT)
    assert len(side(found, 39.5)) > 10
    assert not side(found, 39.5).any()


def test_a_gap_longer_than_its_shadow_occludes() -> None:
    mask, depth = scene()
    width = round(SHIFT * (1 / BODY - 1 / WALL))
    depth[20:40, 40 - width - 12 : 40] = 0.0
    assert side(find_silhouette(mask, depth, SHIFT), 39.5).all()


def test_a_hand_too_near_to_be_measured_occludes() -> None:
    mask, depth = scene()
    mask[:, 90:], depth[:, 90:] = False, 0.0
    found = find_silhouette(mask, depth, SHIFT)
    assert side(found, 89.5).all()
    assert not side(found, 39.5).any()


def test_readings_that_fly_at_the_edge_do_not_occlude() -> None:
    mask, depth = scene()
    depth[:, 120] = 0.70  # one column between body and wall, nearer than either
    assert not side(find_silhouette(mask, depth, SHIFT), 119.5).any()


def test_the_images_border_is_no_silhouette() -> None:
    mask, depth = scene()
    cut = np.s_[25:, 60:]
    found = find_silhouette(mask[cut], depth[cut], SHIFT)
    assert len(found.pixels) == 60 + 15  # below, and to the right
    assert found.pixels.min() == 0.0  # nothing halfway to what lies outside


@pytest.mark.parametrize("reading", [0.0, BODY])
def test_a_blob_that_fills_the_image_has_no_silhouette(reading: float) -> None:
    found = find_silhouette(np.ones((20, 30), bool), np.full((20, 30), reading, np.float32), SHIFT)
    assert found.pixels.shape == (0, 2)
    assert found.occluded.shape == (0,)
