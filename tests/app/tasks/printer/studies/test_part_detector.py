import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.app.studies.detector.wanted import wanted_maps
from regrasp.app.tasks.printer.cells import printer_cell
from regrasp.app.tasks.printer.studies.detector import pictures as part_pictures
from regrasp.app.tasks.printer.studies.detector.pictures import PartPictures, changed, make_pictures
from regrasp.app.tasks.printer.studies.detector.score import held_out_shots, part_detector_figures, scored
from regrasp.interfaces.printer.actions import CLASSES
from regrasp.interfaces.printer.cell import PrinterCell
from regrasp.perception.pose.detector import shipped_network
from regrasp.perception.printer.detector import CELLS, NETWORK_SHAPE, PartDetector, decode, mirrored


@pytest.fixture(scope="module")
def cell() -> PrinterCell:
    return printer_cell("habitat_open")


@pytest.fixture(scope="module")
def pictures(cell: PrinterCell) -> PartPictures:
    return make_pictures(cell, 5, 12)


def test_the_shipped_network_finds_part_and_fingers_in_another_chamber(cell: PrinterCell) -> None:
    detector = PartDetector()
    pictures = [scored(detector, shot) for shot in held_out_shots(cell, 77, 30)]
    figures = part_detector_figures(pictures)
    assert figures["map50"] > 0.85  # of 400 such pictures it has 0.98
    assert all(each["recall"][1] >= 15 for each in figures["classes"].values())
    boxes = np.array([detection.box for picture in pictures for detection in picture.detections])
    intrinsics = cell.known.camera("hand").intrinsics
    assert boxes.min() == -0.5  # a thing that the picture's edge cuts, and none beyond it
    assert np.all(boxes <= np.array([intrinsics.width, intrinsics.height] * 2) - 0.5)


@pytest.mark.parametrize("class_number", range(len(CLASSES)))
def test_maps_of_the_mirror_image_tell_the_mirrored_box(class_number: int) -> None:
    maps = np.zeros((len(CLASSES) * 5, *CELLS), np.float32)
    box = 80.0, 40.0, 120.0, 64.0
    wanted = wanted_maps([(box, True, ())], NETWORK_SHAPE)
    maps[class_number] = wanted[0]
    maps[len(CLASSES) + 4 * class_number :][:4] = wanted[1:5]
    (found,) = decode(mirrored(maps), 1.0, 0.9)
    other = {"lgrip": "rgrip", "rgrip": "lgrip"}.get(CLASSES[class_number], CLASSES[class_number])
    assert found.name == other
    width = NETWORK_SHAPE[1]
    assert np.array(found.box) + 0.5 == pytest.approx([width - box[2], box[1], width - box[0], box[3]], abs=1e-3)
    assert np.array_equal(mirrored(mirrored(maps)), maps)


def test_pictures_depend_on_the_seed_alone(cell: PrinterCell, pictures: PartPictures) -> None:
    again, other = make_pictures(cell, 5, 3), make_pictures(cell, 6, 3)
    assert np.array_equal(again.images, pictures.images[:3])
    assert np.array_equal(again.boxes, pictures.boxes[:3], equal_nan=True)
    assert not np.array_equal(other.images, pictures.images[:3])


def test_every_sixth_picture_shows_no_part_and_the_fingers_are_left_and_right(pictures: PartPictures) -> None:
    obj, targ, left, right = (CLASSES.index(name) for name in CLASSES)
    assert np.isnan(pictures.boxes[5::6, [obj, targ]]).all()
    assert not pictures.counts[5::6, [obj, targ]].any()
    both = pictures.counts[:, left] & pictures.counts[:, right]
    assert both.sum() >= 8
    middles = pictures.boxes[both].reshape(-1, 4, 2, 2).mean(axis=2)[..., 0]
    assert (middles[:, left] < middles[:, right]).all()


def test_a_changed_picture_keeps_each_thing_in_its_box(pictures: PartPictures, monkeypatch: pytest.MonkeyPatch) -> None:
    """A white box in a black picture of each class: what the maps tell of it is where the changed picture is white."""
    monkeypatch.setattr(part_pictures, "recolored", lambda image, _rng: image)
    compared = 0
    for k, name in enumerate(CLASSES):
        box = np.array([150.0 + 10 * k, 120.0, 230.0, 190.0], np.float32)
        image = np.zeros((1, *NETWORK_SHAPE, 3), np.uint8)
        image[0, 120:190, 150 + 10 * k : 230] = 255
        boxes, counts = np.full((1, 4, 4), np.nan, np.float32), np.zeros((1, 4), np.bool_)
        boxes[0, k], counts[0, k] = box, True
        drawn = replace(pictures, images=image, boxes=boxes, counts=counts)
        for seed in range(12):
            seen, maps = changed(drawn, 0, np.random.default_rng(seed))
            found = decode(np.concatenate([maps[:, 0], maps[:, 1:5].reshape(16, *maps.shape[2:])]), 1.0, 0.99)
            if not found:
                continue
            compared += 1
            rows, columns = np.nonzero(seen[..., 0] >= 128)
            white = [columns.min() - 0.5, rows.min() - 0.5, columns.max() + 0.5, rows.max() + 0.5]
            assert np.abs(np.array(found[0].box) - white).max() < 1.5
            assert found[0].name == name or name in ("lgrip", "rgrip")  # a mirror makes one the other
    assert compared > 30


corner = st.floats(8, 200)
edge = st.floats(8, 100)


@given(corner, corner, edge, edge, st.sampled_from(CLASSES))
def test_what_is_asked_of_the_network_reads_as_the_box(
    u: float, v: float, width: float, height: float, name: Any
) -> None:
    box = (u, v, u + width, v + height)
    empty = wanted_maps([], NETWORK_SHAPE)
    each = [wanted_maps([(box, True, ())], NETWORK_SHAPE) if n == name else empty for n in CLASSES]
    maps = np.stack(each)
    (found,) = decode(np.concatenate([maps[:, 0], maps[:, 1:5].reshape(16, *maps.shape[2:])]), 1.0, 0.99)
    assert (found.name, found.score) == (name, 1.0)
    assert np.array(found.box) + 0.5 == pytest.approx(np.array(box), abs=1e-2)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["evaluate-part-detector", "none.onnx"], "is no file; name an ONNX file that `regrasp train-part-detector`"),
        (["evaluate-part-detector", "--cell", "thesis"], "'thesis' has no printer; name a cell that has one"),
        (["evaluate-part-detector", "--out", "a.onnx"], "end it in .json"),
    ],
)
def test_bad_input_gets_one_error(arguments: list[str], told: str) -> None:
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 2
    assert told in result.stderr


def test_another_network_is_refused(tmp_path: Path) -> None:
    (tmp_path / "other.onnx").write_bytes(shipped_network())
    result = CliRunner().invoke(app, ["evaluate-part-detector", str(tmp_path / "other.onnx")])
    assert result.exit_code == 2
    assert "other.onnx: holds no such network; name one that `regrasp train-part-detector` made" in result.stderr


def test_a_tiny_training_leaves_a_network_and_its_figures_and_the_seed_decides(tmp_path: Path) -> None:
    pytest.importorskip("torch", reason="the extra train is missing")
    pytest.importorskip("onnx", reason="the extra train is missing")
    sizes = ("--pictures", "24", "--steps", "2", "--held-out", "4")
    outs = tmp_path / "first", tmp_path / "again"
    results = [CliRunner().invoke(app, ["train-part-detector", "--out", str(out), *sizes]) for out in outs]
    assert [r.exit_code for r in results] == [0, 0], results[0].output
    assert 1000 < (outs[0] / "part_detector.onnx").stat().st_size < 2_000_000
    assert json.loads((outs[0] / "evaluation.json").read_text())["pictures"] == 4
    assert sys.modules.get("triton") is None  # loaded after Mesa's OpenGL it crashes the process
    for name in ("part_detector.onnx", "evaluation.json"):
        assert (outs[0] / name).read_bytes() == (outs[1] / name).read_bytes()
