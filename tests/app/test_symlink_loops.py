"""A link that leads back to itself, in the place of every file and folder that a command takes: a finding, exit 2."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from regrasp.app.cli.commands import app

COMMANDS = """
run loop.yaml
run no_obstacle --set tree=loop.xml
run no_obstacle --set cell=loop.yaml
run no_obstacle --out loop
run no_obstacle --out loop/inside
run no_obstacle --all --out loop
run no_obstacle --all --junit loop.xml
scenarios check loop.yaml
scenarios show loop.yaml
trees show loop.xml
trees check loop.xml
trees export loop.xml
trees export recovery -o loop.svg
trees export recovery --run loop
explain loop
replay loop
diff loop loop
study demo --seeds 0:1 --out loop
study pose --out loop
study pose --cell loop.yaml
study coverage --out loop
study motion --out loop
calibrate --images loop
calibrate --out loop.yaml
calibrate --draw loop
calibrate --cell loop.yaml
perceive --rgb loop.png --depth loop.png --intrinsics loop.yaml
perceive --rgb loop.png --depth loop.png --intrinsics loop.yaml --draw loop.png
perceive --technique fiducial --cell loop.yaml --rgb loop.png --intrinsics loop.yaml
snapshot loop.yaml --out pictures
snapshot no_obstacle --out loop
evaluate-detector loop.onnx
evaluate-detector --out loop.json
train-detector --out loop
""".strip().splitlines()


@pytest.mark.parametrize("command", COMMANDS)
def test_a_link_that_leads_back_to_itself_is_a_finding(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for suffix in ("", ".yaml", ".xml", ".svg", ".png", ".json", ".onnx"):
        Path(f"loop{suffix}").symlink_to(f"loop{suffix}")
    before = sorted(tmp_path.iterdir())
    ran = CliRunner().invoke(app, command.split())
    assert isinstance(ran.exception, SystemExit)
    assert (ran.exit_code, ran.stdout) == (2, "")
    assert any("loop" in line for line in ran.stderr.splitlines())
    assert sorted(tmp_path.iterdir()) == before
    assert all(path.is_symlink() for path in before)
