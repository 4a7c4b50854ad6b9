import json
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.app.tasks.cable.cells import cable_cell
from regrasp.app.tasks.cable.studies.motion.birrt import birrt_in
from regrasp.app.tasks.cable.studies.motion.infeasible import INFEASIBLE
from regrasp.app.tasks.cable.studies.motion.queries import KINDS
from regrasp.app.tasks.cable.studies.motion.study import motion_figures, run_motion
from regrasp.app.tasks.cable.studies.motion.trial import (
    BIRRT,
    OURS,
    Answer,
    InfeasibleRow,
    QueryRow,
    TrialParameters,
    run_trial,
)

ALONE = TrialParameters(birrt=False, coal=False)


def query(seed: int, ours: Answer, birrt: Answer, touched: str | None = "") -> QueryRow:
    return QueryRow(seed, "to sleep", 2, 0.015, {OURS: ours, BIRRT: birrt}, touched=touched, straight=1, unproven=seed)


def test_figures_by_hand() -> None:
    rows: list[QueryRow | InfeasibleRow] = [
        query(0, Answer(10.0, 2.0), Answer(100.0, 3.0)),
        query(1, Answer(20.0, 4.0), Answer(300.0, 5.0), "foam"),
        query(2, Answer(30.0, 9.0), Answer(200.0, None)),
        query(3, Answer(40.0, None), Answer(400.0, 1.0), None),
        InfeasibleRow(4, "walled in", 3, "planning_failed", "planning_failed", "no path", True, 99.0),
        InfeasibleRow(5, "out of reach", 3, "out_of_reach", "", "went on", False, 1.0),
    ]
    found = motion_figures(rows, TrialParameters(birrt=True, coal=True))
    assert (found["solved"], found["infeasible_named"], found["contacts"]) == ([3, 4], [1, 2], 1)
    assert found["plan_ms"] == {"median": 25.0, "p95": pytest.approx(38.5)}
    assert (found["path_length_rad"], found["paths_compared"]) == (3.0, 2)
    assert found["birrt"][BIRRT]["solved"] == [3, 4]
    assert found["birrt"][BIRRT]["path_length_rad"] == 4.0
    assert found["left_out"] == {"straight": 4, "unproven": 6, "unproven_solved": 0}
    assert found["infeasible"]["walled in"] == {"named": [1, 1], "expected": "planning_failed", "max_ms": 99.0}
    alone = motion_figures(rows, ALONE)
    assert (alone["contacts"], alone["birrt"]) == (None, None)
    assert "pip install -e '.[bench]'" in alone["contacts_why"]
    assert "pip install -e '.[bench]'" in alone["birrt_why"]


def test_kinds_take_turns() -> None:
    cell = cable_cell("thesis")
    rows = [run_trial(cell, seed, ALONE)[0] for seed in (3, 4)]
    assert [type(row) for row in rows] == [InfeasibleRow, QueryRow]
    assert [row.kind for row in rows] == [next(iter(INFEASIBLE)), list(KINDS)[4]]
    assert all(row.seed == seed for row, seed in zip(rows, (3, 4), strict=True))


def test_a_study_without_the_extra_says_what_is_missing_and_goes_on_where_it_stopped(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert run_motion(range(2, 4), 1, out, ALONE) == 0
    told = capfd.readouterr()
    assert "[2/2] query 3: out of reach: named" in told.err
    assert told.out.count("pip install -e '.[bench]'") == 2
    found = json.loads((out / "motion.json").read_text())
    assert (found["solved"], found["infeasible_named"], found["contacts"]) == ([1, 1], [1, 1], None)
    assert (found["seeds"], [row["seed"] for row in found["rows"]]) == ([2, 3], [2, 3])
    assert {"regrasp", "ompl"} <= found["versions"].keys()
    assert found["rows"][0]["answers"][OURS]["path_length_rad"] == found["path_length_rad"] > 0
    assert run_motion(range(2, 4), 1, out, ALONE) == 0
    assert "2 of 2 are done already" in capfd.readouterr().err
    assert json.loads((out / "motion.json").read_text()) == found


def test_birrt_is_left_out_where_its_package_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pybullet_planning", None)
    with birrt_in(cable_cell("thesis"), None) as birrt:  # type: ignore[arg-type]
        assert birrt is None


def test_bad_options_are_findings(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").touch()
    for options in (["--seeds", "5:5"], ["--seeds", "a"], ["--out", str(tmp_path / "mine.txt")]):
        ran = CliRunner().invoke(app, ["study", "motion", *options])
        assert (ran.exit_code, ran.stdout) == (2, "")
        assert "Traceback" not in ran.stderr
