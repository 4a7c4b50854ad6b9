"""`regrasp calibrate`, as a user types it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.app.files.findings import Findings
from regrasp.app.frames.calibration_file import CalibrationFile, load_calibration, write_calibration
from regrasp.interfaces.frame import Intrinsics
from regrasp.sim.cameras.board import board_pictures, board_poses

K = Intrinsics.from_fov(424, 240, float(np.deg2rad(65.0)))


def invoke(*args: str) -> Any:
    return CliRunner().invoke(app, ["calibrate", *args])


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def boards() -> list[Any]:
    poses = board_poses(K, 7, 5, 0.03, 8, np.random.default_rng(2))
    return list(board_pictures(K, poses, 7, 5, 0.03))


def save(folder: Path, pictures: Sequence[Any]) -> Path:
    folder.mkdir(exist_ok=True)
    for i, rgb in enumerate(pictures):
        assert cv2.imwrite(str(folder / f"{i}.png"), rgb[:, :, ::-1])
    return folder


MINE = ("--columns", "7", "--rows", "5", "--square", "0.03")


def test_rendered_boards_are_compared_with_what_is_true(tmp_path: Path) -> None:
    result = invoke("--views", "8", "--draw", "drawn", "-o", "rear.yaml")
    assert result.exit_code == 0, result.output
    assert "view_008" in result.output
    assert "true  error" in result.output
    file = load_calibration(tmp_path / "rear.yaml")
    true = Intrinsics.from_fov(848, 480, float(np.deg2rad(65.0)))
    assert file.intrinsics.fx == pytest.approx(true.fx, rel=0.005)
    assert file.rms is not None
    assert file.rms < 0.3
    assert len(list((tmp_path / "drawn").glob("*.png"))) >= 5
    first = (tmp_path / "rear.yaml").read_bytes()
    assert invoke("--views", "8", "-o", "again.yaml").exit_code == 0
    assert (tmp_path / "again.yaml").read_bytes() == first


def test_a_folder_of_pictures(tmp_path: Path, boards: list[Any]) -> None:
    folder = save(tmp_path / "photos", [*boards, np.full_like(boards[0], 128)])
    (folder / "notes.txt").write_text("no picture")
    result = invoke("--images", str(folder), *MINE, "--draw", "drawn")
    assert result.exit_code == 0, result.output
    lines = {line.split()[0]: line.split()[1:] for line in result.output.splitlines() if line}
    assert lines["8.png"][:2] == ["not", "found"]
    assert lines["0.png"][0] == "35"
    assert "true" not in result.output
    assert load_calibration(tmp_path / "calibration.yaml").intrinsics.fx == pytest.approx(K.fx, rel=0.01)
    drawn = cv2.imread(str(tmp_path / "drawn" / "0.png"))
    assert drawn is not None
    assert (drawn != boards[0][:, :, ::-1]).any()


def test_every_picture_is_drawn_whatever_its_name(tmp_path: Path, boards: list[Any]) -> None:
    folder = save(tmp_path / "photos", boards[:5])
    cv2.imwrite(str(folder / "0.jpg"), boards[5][:, :, ::-1], [cv2.IMWRITE_JPEG_QUALITY, 98])
    result = invoke("--images", "photos", *MINE, "--draw", "drawn", "-o", "new/camera.yaml")
    assert result.exit_code == 0, result.output
    assert len(list((tmp_path / "drawn").iterdir())) == 6
    assert (tmp_path / "new" / "camera.yaml").exists()


def finding(*args: str) -> str:
    result = invoke(*args)
    assert result.exit_code == 2, result.output
    assert "Traceback" not in result.output
    return str(result.output).strip()


def test_bad_folders_and_pictures_are_findings(tmp_path: Path, boards: list[Any]) -> None:
    assert finding("--images", "gone").startswith("gone: is no folder")
    (tmp_path / "empty").mkdir()
    assert "empty: holds 0 images" in finding("--images", "empty")
    folder = save(tmp_path / "photos", boards)
    assert "seen in 0 of 8 pictures" in finding("--images", "photos")  # of another size than the board that is shown
    (folder / "8.png").write_bytes(b"\x89PNG\r\n\x1a\nno more")
    (folder / "9.jpg").write_bytes(b"")
    told = finding("--images", "photos", *MINE)
    assert [line.split(":")[0] for line in told.splitlines()] == ["photos/8.png", "photos/9.jpg"]
    (folder / "8.png").unlink()
    (folder / "9.jpg").unlink()
    cv2.imwrite(str(folder / "8.png"), np.zeros((240, 320, 3), np.uint8))
    assert "pictures of several sizes: 0.png is 424x240, 8.png is 320x240" in finding("--images", "photos", *MINE)
    cv2.imwrite(str(folder / "8.png"), np.zeros((5, 5, 3), np.uint8))
    assert "photos/8.png: is 5x5 pixels" in finding("--images", "photos", *MINE)


def test_views_all_alike_are_refused(tmp_path: Path, boards: list[Any]) -> None:
    save(tmp_path / "photos", [boards[0]] * 6)
    told = finding("--images", "photos", *MINE)
    assert "only 1 of 6 views differ" in told
    assert not (tmp_path / "calibration.yaml").exists()


def test_bad_options_are_findings(tmp_path: Path) -> None:
    assert "--camera: no camera 'read'; did you mean 'rear'?" in finding("--camera", "read")
    assert "no cell named 'thesi'" in finding("--cell", "thesi")
    (tmp_path / "file").write_text("")
    assert "is no folder" in finding("-o", "file/x.yaml")
    (tmp_path / "folder").mkdir()
    assert "folder: is a folder; name a file" in finding("-o", "folder")
    assert "--draw: is the folder of your pictures" in finding("--images", "folder", "--draw", "./folder")
    assert invoke("--square", "0").exit_code == 2
    assert invoke("--columns", "2").exit_code == 2


def test_a_file_is_read_back_and_what_is_wrong_in_it_is_told(tmp_path: Path) -> None:
    file = CalibrationFile(
        width=640, height=480, fx=600.5, fy=601.0, cx=319.5, cy=239.5, distortion=(0.1, 0, 0, 0, 0), rms=0.1
    )
    path = tmp_path / "c.yaml"
    write_calibration(path, file)
    assert load_calibration(path) == file
    assert load_calibration(path).intrinsics == Intrinsics(640, 480, 600.5, 601.0, 319.5, 239.5)
    path.write_text(path.read_text().replace("fx: 600.5", "fx: -1").replace("height", "heigth"))
    with pytest.raises(Findings) as error:
        load_calibration(path)
    assert [item.line for item in error.value.items] == [2, 3]


def test_one_view_many_times_is_no_calibration(tmp_path: Path, boards: list[Any]) -> None:
    """A still board, with a camera's noise, gave a focal length twice the true one to 0.3 %."""
    rng = np.random.default_rng(1)
    still = [np.clip(boards[0] + rng.normal(0.0, 3.0, boards[0].shape), 0, 255).astype(np.uint8) for _ in range(8)]
    result = invoke("--images", str(save(tmp_path / "still", still)), *MINE)
    assert result.exit_code == 2
    assert "only 1 of 8 views differ" in result.output
    assert not (tmp_path / "calibration.yaml").exists()


def test_a_picture_is_not_overwritten_by_the_calibration(tmp_path: Path, boards: list[Any]) -> None:
    folder = save(tmp_path / "mine", boards)
    before = (folder / "0.png").read_bytes()
    result = invoke("--images", str(folder), *MINE, "--out", str(folder / "0.png"))
    assert (result.exit_code, (folder / "0.png").read_bytes()) == (2, before)
    assert "end it in .yaml" in result.output


def test_a_calibration_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "calibration.yaml").write_text("mine")
    assert "calibration.yaml: exists already; name another file, or remove it" in finding("--camera", "rear")
    assert (tmp_path / "calibration.yaml").read_text() == "mine"
