"""The approach study: trials in a real world, its figures, and its commands."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.app.files.resources import shipped
from regrasp.app.scenario.cell_file import load_cell
from regrasp.app.tasks.printer.studies.approach import approach_figures
from regrasp.app.tasks.printer.studies.approach_trial import ApproachParameters, Block, Trial, run_trial
from regrasp.interfaces.printer.actions import Approach
from regrasp.interfaces.printer.cell import PrinterCell
from regrasp.perception.printer.approach_tables import load_tables


def trial(block: Block, approach: Approach, start: str, seed: int = 2) -> Trial:
    cell = load_cell(shipped("cell")["habitat_open"])
    assert isinstance(cell, PrinterCell)
    (found,) = run_trial(cell, block, approach, start, seed, ApproachParameters())
    return found


@pytest.mark.parametrize("start", ["20-LL", "40-LL", "45-UR"])
def test_the_servo_comes_within_two_millimeters_and_takes_the_part(start: str) -> None:
    found = trial("A", "servo", start)
    assert found.error is not None, found.why
    assert np.linalg.norm(found.error) < 0.002
    assert found.grasped is True
    assert found.path[0][1] > 10 * abs(found.path[-1][1])


def test_the_servo_finds_a_part_that_is_turned_and_elsewhere() -> None:
    found = trial("B", "servo", "drawn")
    assert found.error is not None, found.why
    assert np.linalg.norm(found.error) < 0.002
    assert found.grasped is True


def test_the_servo_follows_a_part_that_drifts() -> None:
    found = trial("C", "servo", "30-BA")
    assert found.error is not None, found.why
    assert np.linalg.norm(found.error) < 0.004
    assert found.grasped is None


def test_with_steps_the_hand_comes_nearer_than_with_one() -> None:
    errors = []
    for approach in ("one_step", "three_step"):
        found = trial("A0", approach, "40-LL")
        assert found.error is not None, found.why
        errors.append(float(np.linalg.norm(found.error)))
    assert errors[1] < 0.006
    assert errors[1] < 0.5 * errors[0]


def test_figures_of_trials_that_failed_and_that_did_not() -> None:
    good = Trial("A", "servo", "20-LL", 0, (0.003, 0.0, 0.004), "", 2.0, True)
    bad = Trial("A", "servo", "25-UR", 0, None, "target_not_seen: no", 3.0, False)
    figures = approach_figures([good, bad])["approaches"]["servo"]
    assert figures["mean_xyz_m"] == pytest.approx(0.005)
    assert figures["mean_yz_m"] == pytest.approx(0.004)
    assert (figures["trials"], figures["failed"], figures["grasped"]) == (2, 1, [1, 2])
    assert figures["by_start"]["25-UR"]["mean_x_m"] is None


def test_the_command_keeps_figures_table_and_plots(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    words = ["study", "approach", "--seeds", "0:1", "--blocks", "B", "--approaches", "servo", "--jobs", "1"]
    ended = CliRunner().invoke(app, [*words, "--out", str(tmp_path)])
    assert ended.exit_code == 0, ended.output
    found = json.loads((tmp_path / "approach.json").read_text())
    assert found["approaches"]["servo"]["block"]["B"]["trials"] == 1
    assert (tmp_path / "approach.csv").read_text().startswith("block,approach,start,seed,x_m")
    for name in ("errors.png", "paths.png", "time.png"):
        assert (tmp_path / name).read_bytes()[:4] == b"\x89PNG"
    told = ended.output + capfd.readouterr().out
    assert "X-Y-Z mm" in told
    assert "a cycle of the servo's tracking takes" in told


def test_the_shipped_tables_are_what_the_command_makes(tmp_path: Path) -> None:
    out = tmp_path / "tables.json"
    ended = CliRunner().invoke(app, ["calibrate-approach", "-o", str(out)])
    assert ended.exit_code == 0, ended.output
    made, ours = load_tables(out), load_tables()
    assert made.area == pytest.approx(ours.area, rel=0.02)
    assert made.scale == pytest.approx(ours.scale, rel=0.02)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["study", "approach", "--seeds", "0:1", "--blocks", "A,Z"], "no 'Z'"),
        (["study", "approach", "--seeds", "0:1", "--approaches", "servos"], "did you mean 'servo'"),
        (["calibrate-approach", "-o", "t.json", "--cell", "thesis"], "has no printer"),
        (["calibrate-approach", "-o", "t.json", "--cell", "habitat"], "is the door of"),
    ],
)
def test_what_cannot_be_is_one_line(
    words: list[str], told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    ended = CliRunner().invoke(app, words)
    assert ended.exit_code != 0
    text = ended.output + str(ended.exception)
    assert told in text, text
    assert not list(tmp_path.iterdir())
