"""The examples of docs/python.md, in their order, each in the names that those before it made."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

import regrasp
from regrasp.app.cli.commands import app

PAGE = Path(__file__).parents[2] / "docs" / "python.md"


def test_the_examples_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    assert CliRunner().invoke(app, ["snapshot", "no_obstacle", "--out", "frames"]).exit_code == 0
    examples = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert len(examples) == 6
    names: dict[str, object] = {}
    for example in examples:
        exec(compile(example, str(PAGE), "exec"), names)
    told = capsys.readouterr().out
    for sentence in (
        "failure True",
        "back_2",
        "no 'mars'; there are earth, zero",
        "interrupted recovery/mission/unplug",
        "NoEstimate",
    ):
        assert sentence in told
    assert isinstance(names["found"], (regrasp.Estimate, regrasp.NoEstimate))


def test_the_page_names_only_what_is_promised() -> None:
    named = set(re.findall(r"\bregrasp\.([A-Za-z_]+)", PAGE.read_text(encoding="utf-8")))
    assert named - {"sim", "perception", "__all__"} <= set(regrasp.__all__)
