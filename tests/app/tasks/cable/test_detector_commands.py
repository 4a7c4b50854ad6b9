import sys
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.perception.pose.detector import NETWORK_INPUT, shipped_network


def invoke(*args: str) -> Any:
    return CliRunner().invoke(app, args)


def test_without_torch_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    monkeypatch.setitem(sys.modules, "onnx", None)
    result = invoke("train-detector", "--out", str(tmp_path / "out"))
    assert result.exit_code == 2
    assert "pip install -e '.[train]' in the project's folder" in result.output
    assert not (tmp_path / "out").exists()


def test_a_folder_that_holds_a_network_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "detector.onnx").write_bytes(b"mine")
    result = invoke("train-detector", "--out", str(tmp_path))
    assert result.exit_code == 2
    assert "already holds detector.onnx" in result.output
    assert (tmp_path / "detector.onnx").read_bytes() == b"mine"


@pytest.mark.parametrize("data", [b"", b"no network", None])
def test_a_file_without_a_network_is_one_line(tmp_path: Path, data: bytes | None) -> None:
    file = tmp_path / "bad.onnx"
    if data is not None:
        file.write_bytes(data)
    result = invoke("evaluate-detector", str(file))
    assert result.exit_code == 2
    assert result.output.count("\n") == 1
    assert "bad.onnx" in result.output


def test_a_network_with_another_input_is_one_line(tmp_path: Path) -> None:
    """OpenCV alone would compute something of it."""
    (tmp_path / "older.onnx").write_bytes(
        shipped_network().replace(NETWORK_INPUT.encode(), NETWORK_INPUT.upper().encode())
    )
    result = invoke("evaluate-detector", str(tmp_path / "older.onnx"))
    assert result.exit_code == 2
    assert result.output.count("\n") == 1
    assert "older.onnx" in result.output


def test_a_folder_for_the_figures_is_refused_at_once(tmp_path: Path) -> None:
    result = invoke("evaluate-detector", "--out", str(tmp_path))
    assert result.exit_code == 2
    assert "is a folder; name a file" in result.output


def test_figures_do_not_overwrite_a_network(tmp_path: Path) -> None:
    (tmp_path / "mine.onnx").write_bytes(b"mine")
    result = invoke("evaluate-detector", str(tmp_path / "mine.onnx"), "--out", str(tmp_path / "mine.onnx"))
    assert (result.exit_code, (tmp_path / "mine.onnx").read_bytes()) == (2, b"mine")
    assert "end it in .json" in result.output
