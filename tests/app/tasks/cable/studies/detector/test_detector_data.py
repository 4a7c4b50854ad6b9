from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from regrasp.app.tasks.cable.studies.detector.crops import AugmentationParameters, Target, draw_crop, target_maps
from regrasp.app.tasks.cable.studies.detector.data import Pictures, make_pictures
from regrasp.interfaces.cable.cell import CableCell
from regrasp.perception.pose.detector import decode


@pytest.fixture(scope="module")
def pictures(cell: CableCell) -> Pictures:
    return make_pictures(cell, 5, 24)


def test_pictures_depend_on_the_seed_alone(cell: CableCell, pictures: Pictures) -> None:
    again, other = make_pictures(cell, 5, 3), make_pictures(cell, 6, 3)
    assert np.array_equal(again.images, pictures.images[:3])
    assert np.array_equal(again.sizes, pictures.sizes[:3])
    assert np.array_equal(again.masks, pictures.masks[:3])
    assert not np.array_equal(other.images, pictures.images[:3])


def test_masks_and_axes_belong_to_the_connector(pictures: Pictures) -> None:
    """In the image the mask's longer direction is the axis', where it is seen from the side."""
    compared = 0
    for mask, axis in zip(pictures.masks >= 128, pictures.axes, strict=True):
        v, u = np.nonzero(mask)
        if len(u) < 60 or np.linalg.norm(axis) < 0.8:
            continue
        spread, turns = np.linalg.eigh(np.cov(u, v))
        if spread[1] > 9 * spread[0]:
            compared += 1
            assert abs(turns[:, 1] @ axis) > 0.95 * np.linalg.norm(axis)
    assert compared >= 3
    assert not pictures.masks[5::6].any()  # every sixth is without


def test_crops_depend_on_the_generator_alone(pictures: Pictures) -> None:
    for i in range(10):
        (a, sizes, truth), (b, same, again) = (draw_crop(pictures, np.random.default_rng(i)) for _ in range(2))
        assert np.array_equal(a, b)
        assert np.array_equal(sizes, same)
        assert truth == again


def test_crops_keep_the_connector_in_its_box(pictures: Pictures, monkeypatch: pytest.MonkeyPatch) -> None:
    """A white connector in a black picture reaches all four edges of its box, and no pixel of it is outside."""
    monkeypatch.setattr("regrasp.app.tasks.cable.studies.detector.crops._cut_out", lambda *_: None)
    monkeypatch.setattr("regrasp.app.tasks.cable.studies.detector.crops.recolored", lambda image, *_: image)
    white = replace(pictures, images=np.zeros_like(pictures.images))
    white.images[pictures.masks >= 128] = 255
    compared = 0
    for i in range(100):
        image, _, targets = draw_crop(white, np.random.default_rng(i))
        if len(targets) == 1 and targets[0].counts:
            compared += 1
            u0, v0, width, height = cv2.boundingRect((image[..., 0] >= 128).astype(np.uint8))
            assert np.abs(np.array(targets[0].box) - [u0, v0, u0 + width, v0 + height]).max() <= 2
    assert compared > 20


corner = st.floats(8, AugmentationParameters.crop_size - 60)
edge = st.floats(6, 50)


@given(corner, corner, edge, edge, st.floats(-np.pi, np.pi), st.floats(0.3, 1.0))
def test_what_is_asked_of_the_network_reads_as_the_target(
    u: float, v: float, width: float, height: float, angle: float, in_plane: float
) -> None:
    box = (u, v, u + width, v + height)
    axis = (in_plane * np.cos(angle), in_plane * np.sin(angle))
    maps = target_maps([Target(box, axis, True)])
    (found,) = decode(maps[:7], 1.0, 0.99)
    assert np.array(found.box) + 0.5 == pytest.approx(np.array(box), abs=1e-3)
    assert found.in_plane == pytest.approx(in_plane, abs=1e-3)
    assert abs((found.angle - angle + np.pi / 2) % np.pi - np.pi / 2) < 1e-3


def test_one_that_shows_too_little_is_left_out() -> None:
    maps = target_maps([Target((40.0, 40.0, 44.0, 44.0), (1.0, 0.0), False)])
    assert not maps[:8].any()
    assert maps[8, 5, 5] == 0
    assert maps[8, 15, 15] == 1
