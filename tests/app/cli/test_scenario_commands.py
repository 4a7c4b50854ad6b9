from pathlib import Path
from typing import Any

import pytest
from toy_scenario import SCENARIO, write_scenario
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.app.files.resources import shipped
from regrasp.app.scenario.load import load_scenario


@pytest.fixture(autouse=True)
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = write_scenario(tmp_path, monkeypatch)
    path.write_text(f"{SCENARIO}vary: {{gravity: [zero, earth]}}\n")
    return path


def invoke(*args: str) -> Any:
    return CliRunner().invoke(app, ["scenarios", *args])


def test_list_counts_the_cases_of_what_is_shipped() -> None:
    lines = [line.split() for line in invoke("list").stdout.splitlines()]
    assert [line[0] for line in lines] == list(shipped("scenario"))
    assert lines[0][1:3] == ["2", "cases"]


def test_check_says_of_each_file_how_many_cases_are_right() -> None:
    ran = invoke("check", "mine.yaml", "mine.yaml", "--set", "gravity=earth")
    assert (ran.exit_code, ran.stdout.splitlines()) == (0, ["mine.yaml: 1 case, nothing wrong"] * 2)


def test_check_tells_the_findings_of_all_files_and_all_cases(scenario: Path) -> None:
    scenario.write_text(SCENARIO.replace("slips: 1", "slips: x") + "vary: {gravity: [zero, mars]}\n")
    ran = invoke("check", "gone.yaml", "mine.yaml")
    assert (ran.exit_code, ran.stdout) == (2, "")
    assert [line.split(" ")[0] for line in ran.stderr.splitlines()] == [
        "gone.yaml:",
        "mine.yaml:18:",
        "mine.yaml:21:",
    ]


def test_show_prints_a_case_that_is_itself_a_scenario(scenario: Path) -> None:
    ran = invoke("show", "mine.yaml", "--case", "gravity=earth", "--set", "inputs.tries=1")
    (scenario.parent / "shown.yaml").write_text(ran.stdout)
    shown = load_scenario("shown.yaml")
    assert shown.file == load_scenario("mine.yaml", ["inputs.tries=1"], "gravity=earth").file
    assert (shown.file.gravity, shown.inputs) == ("earth", {"tries": "1"})


def test_show_names_the_cases_where_none_is_asked_for() -> None:
    lines = invoke("show", "mine.yaml").stdout.splitlines()
    assert lines[:3] == ["# mine: the first of these cases", "#   gravity=zero", "#   gravity=earth"]
    assert "gravity: zero" in lines


DRAW = (
    "draw={obstacles: [{name: foam, count: [1, 2], size: {x: [0.05, 0.05], y: [0.05, 0.05], z: [0.05, 0.1]}, "
    "region: {x: [0.3, 0.4], y: [-0.2, 0.0]}}]}"
)


def test_draw_tells_what_was_thrown_away_and_writes_pictures(tmp_path: Path) -> None:
    changes = [word for change in ("gravity=earth", "obstacles=[]", DRAW) for word in ("--set", change)]
    ran = invoke("draw", "mine.yaml", "--seeds", "7:9", *changes, "--pictures", "seen")
    lines = ran.stdout.splitlines()
    assert (ran.exit_code, len(lines), ran.stderr) == (0, 3, "")
    assert lines[0].startswith("mine gravity=earth, seed 7: ")
    assert lines[-1].startswith("2 scenes drawn; ")
    assert all("scenes thrown away" in line and "blocks thrown away" in line for line in lines)
    pictures = sorted((tmp_path / "seen").iterdir())
    assert [path.name for path in pictures] == ["gravity=earth-7.jpg", "gravity=earth-8.jpg"]
    assert all(path.read_bytes()[:2] == b"\xff\xd8" for path in pictures)


def test_draw_of_what_draws_nothing_and_of_what_cannot_be_solved_is_bad_input() -> None:
    ran = invoke("draw", "mine.yaml")
    assert (ran.exit_code, ran.stderr) == (2, "mine.yaml: it has no draw; write what the seed shall draw\n")
    no_room = DRAW.replace("[0.3, 0.4]", "[0.51, 0.51]")[:-1] + ", tries: 1}"
    ran = invoke("draw", "mine.yaml", "--seeds", "1:2", "--set", no_room)
    assert ran.exit_code == 2
    assert "none of 1 scenes of seed 1 can be solved: 1 no room for its blocks" in ran.stderr
