"""`regrasp perceive --technique printer_part`, as a user types it, on renders that went through files."""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.app.frames.image_files import read_rgb, write_picture
from regrasp.app.studies.detector.precision import true_box
from regrasp.app.tasks.printer.cells import printer_cell
from regrasp.app.tasks.printer.studies.detector.score import held_out_shots
from regrasp.interfaces.printer.actions import CLASSES
from regrasp.perception.detection import intersection_over_union


def invoke(*args: object) -> Any:
    return CliRunner().invoke(app, ["perceive", "--technique", "printer_part", *map(str, args)])


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """A picture that shows part and fingers, and their true boxes by class."""
    path = tmp_path_factory.mktemp("pictures") / "part.png"
    shot = held_out_shots(printer_cell("habitat_open"), 77, 2)[1]
    write_picture(path, np.asarray(shot.rgb, np.uint8))
    return path, {name: true_box(shot.masks[name]) for name in CLASSES}


def test_it_finds_the_part_its_section_and_the_fingers(shot: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    path, boxes = shot
    result = invoke("--rgb", path, "--draw", tmp_path / "new" / "seen.png")
    assert result.exit_code == 0, result.output
    (frame,) = json.loads(result.stdout)["frames"]
    for name in CLASSES:
        assert frame[name]["by"] == "network"
        assert intersection_over_union(frame[name]["box"], boxes[name]) > 0.6
        left, top, right, bottom = frame[name]["box"]
        assert frame[name]["area"] == pytest.approx((right - left) * (bottom - top), rel=0.01)
    left, _, right, _ = frame["targ"]["box"]
    assert frame["targ"]["offset"][0] == pytest.approx((left + right) / 2 - 319.5, abs=0.2)
    drawing, picture = read_rgb(tmp_path / "new" / "seen.png"), read_rgb(path)
    assert drawing.shape == picture.shape
    assert 500 < np.any(drawing != picture, axis=2).sum() < 20_000


def test_a_picture_of_any_size_will_do(shot: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    large = np.asarray(cv2.resize(read_rgb(shot[0]), None, fx=2.5, fy=2.5), np.uint8)
    write_picture(tmp_path / "large.jpg", large)
    write_picture(tmp_path / "tiny.png", large[:2, :3].copy())
    result = invoke("--rgb", tmp_path / "large.jpg", "--rgb", tmp_path / "tiny.png", "--draw", tmp_path / "seen.jpg")
    assert result.exit_code == 0, result.output
    found, none = json.loads(result.stdout)["frames"]
    assert found["obj"]["found"]
    assert found["targ"]["found"]
    assert none["found"] is False
    assert read_rgb(tmp_path / "seen.jpg").shape == large.shape


def test_a_picture_without_a_part_has_a_reason(tmp_path: Path) -> None:
    write_picture(tmp_path / "grey.png", np.full((480, 640, 3), 120, np.uint8))
    result = invoke("--rgb", tmp_path / "grey.png")
    assert result.exit_code == 1
    answer = json.loads(result.stdout)
    assert answer["found"] is False
    assert answer["frames"][0]["obj"]["reason"] == "target_not_seen"
    assert answer["frames"][0]["lgrip"]["message"] == "the picture does not show the left finger"


def test_where_the_network_sees_nothing_the_colour_counts_and_the_answer_says_so(tmp_path: Path) -> None:
    picture = np.full((480, 640, 3), 120, np.uint8)
    picture[100:140, 200:320] = (40, 60, 200)  # a blue bar, nothing like a gripping section
    write_picture(tmp_path / "bar.png", picture)
    answer = json.loads(invoke("--rgb", tmp_path / "bar.png").stdout)["frames"][0]["targ"]
    assert answer["found"] is True
    assert answer["by"] == "color"
    assert answer["box"] == [199.5, 99.5, 319.5, 139.5]
    assert answer["offset"] == [-60.0, -120.0]
    assert answer["area"] == 4800.0


def test_options_that_only_a_pose_needs_are_refused_together_with_wrong_files(tmp_path: Path) -> None:
    (tmp_path / "text.png").write_text("no picture")
    result = invoke("--rgb", tmp_path / "text.png", "--length", 0.1, "--intrinsics", tmp_path / "k.yaml")
    assert result.exit_code == 2
    assert result.stdout == ""
    lines = result.output.splitlines()
    assert lines[0] == "--intrinsics: the technique printer_part has no use for it; leave it out"
    assert lines[1].startswith("--length: ")
    assert "text.png: is no image" in lines[2]
    assert invoke("--rgb", tmp_path / "text.png", "--cell", "thesis").exit_code == 2


def test_an_unknown_technique_is_told_with_the_nearest_one_of_any_task() -> None:
    result = CliRunner().invoke(app, ["perceive", "--technique", "printer_prt", "--rgb", "a.png"])
    assert result.exit_code == 2
    assert result.output == "--technique: no technique 'printer_prt'; did you mean 'printer_part'?\n"
