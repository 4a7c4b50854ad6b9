import os
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest
from toy_scenario import SCENARIO, write_scenario
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.app.cli.run_every import run_every
from regrasp.app.files.findings import Findings
from regrasp.app.records.record import Record
from regrasp.app.records.result import Result
from regrasp.app.run.batch import Row, Run, Settings, row_of, summary
from regrasp.app.run.junit import JunitCase, write_junit
from regrasp.app.run.processes import Done
from regrasp.app.scenario.load import Scenario, cases, load_scenario
from regrasp.app.task.expectation import Expectation
from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cause import Cause


@pytest.fixture(autouse=True)
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = write_scenario(tmp_path, monkeypatch)
    path.write_text(f"{SCENARIO}vary: {{seed: '0:4'}}\n")
    return path


def episode(scenario: Scenario, out: Path | None, *, seed: int, video: bool, renderer: str) -> Result:
    """Comes out for seed 0, not for 1, dies for 2, is lost with a strange word for 3."""
    if seed == 2:
        os._exit(7)
    assert out is not None
    met = seed == 0
    result = Result(
        task="cable",
        scenario=scenario.name,
        seed=seed,
        outcome="success" if met else "failure",
        succeeded=met,
        case=scenario.case,
        cause=None
        if met
        else Cause(CableCause.SEARCH_EXHAUSTED, "nothing <seen> \x1b[31m" if seed == 3 else "18 stops"),
        expectations=(Expectation("slips", met, int(met), 1),),
        sim_seconds=80.0,
        wall_seconds=12.5,
    )
    with Record(out, scenario.name, seed, scenario.case) as record:
        record.finish(result)
    return result


def good(*args: Any, seed: int, video: bool, renderer: str) -> Result:
    return Result(args[0].name, seed, "success", succeeded=True)


def test_every_case_leaves_a_line_a_record_and_a_testcase(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    assert run_every("mine.yaml", [], 2, Path("out"), Path("reports/mine.xml"), episode=episode) == 1
    out, err = capfd.readouterr()
    lines = [line.split() for line in out.splitlines()]
    assert lines[0] == ["case", "as", "expected", "outcome", "simulated", "s", "seconds"]
    assert lines[1] == ["seed=0", "yes", "success", "80.0", "12.5"]
    assert lines[3] == ["seed=2", "no", "internal_error", "0.0", "0.0"]
    assert "seed=1: search_exhausted: 18 stops; slips is 0, expected at least 1, all noticed" in out.splitlines()
    assert out.splitlines()[-1] == "mine: 1 of 4 cases as expected; records in out"
    assert "[4/4]" in err
    assert sorted(p.name for p in Path("out").iterdir()) == ["seed=0", "seed=1", "seed=3"]

    suites = ET.parse("reports/mine.xml").getroot()
    [suite] = suites
    assert (suites.tag, suite.tag) == ("testsuites", "testsuite")
    counts = {"tests": "4", "failures": "2", "errors": "1", "skipped": "0", "time": "37.500"}
    assert counts.items() <= suite.attrib.items()
    assert suite[0].attrib == {"classname": "mine", "name": "seed=0", "time": "12.500"}
    assert [[below.tag for below in c] for c in suite] == [
        ["system-out"],
        ["failure", "system-out"],
        ["error", "system-out"],
        ["failure", "system-out"],
    ]
    assert suite[0][0].text == "out/seed=0"
    assert suite[1][0].attrib == {
        "type": "search_exhausted",
        "message": "search_exhausted: 18 stops; slips is 0, expected at least 1, all noticed",
    }
    page = suite[1][0].text or ""
    assert page == CliRunner().invoke(app, ["explain", "out/seed=1"]).stdout
    assert page.startswith("mine seed=1, seed 1: failure, 0 of 1 expectations met, 80.0 simulated seconds\n")
    assert "Why it ended so\n  search_exhausted: 18 stops\n" in page
    assert suite[2][0].text == suite[2][0].attrib["message"]  # it left no record
    assert suite[2][0].attrib["message"] == "internal_error: the process died with exit code 7"
    assert "  search_exhausted: nothing <seen> \\x1b[31m\n" in (suite[3][0].text or "")
    assert suite[3][0].attrib["message"].startswith("search_exhausted: nothing <seen> \\x1b[31m; ")


def test_all_as_expected_exits_0_and_a_set_value_narrows(capfd: pytest.CaptureFixture[str]) -> None:
    assert run_every("mine.yaml", ["seed=0"], 1, settings=Settings(quiet=True), episode=good) == 0
    out, err = capfd.readouterr()
    assert out.splitlines()[-1] == "mine: 1 of 1 cases as expected; records in runs/mine-all-1"
    assert err == ""


def test_ctrl_c_keeps_what_was_done_and_tells_what_was_not(tmp_path: Path) -> None:
    runs = [Run(case, case.file.seed, tmp_path / str(i)) for i, case in enumerate(cases("mine.yaml"))]
    done = row_of(runs[1], Done(1, good(runs[1].scenario, seed=1, video=False, renderer="software"), "", 0.0))
    tested = [JunitCase("mine", run.scenario.case, {1: done}.get(n), run.folder) for n, run in enumerate(runs)]
    write_junit(tmp_path / "cut.xml", "mine", tested)
    [suite] = ET.parse(tmp_path / "cut.xml").getroot()
    assert (suite.attrib["tests"], suite.attrib["skipped"]) == ("4", "3")
    assert [c[0].tag for c in suite] == ["skipped", "system-out", "skipped", "skipped"]


def test_all_that_is_wrong_is_told_before_anything_runs(tmp_path: Path) -> None:
    (tmp_path / "out" / "seed=1").mkdir(parents=True)
    (tmp_path / "out" / "seed=1" / "result.json").write_text("{}")
    with pytest.raises(Findings) as raised:
        run_every("mine.yaml", [], 1, Path("out"), Path("out"), episode=good)
    assert str(raised.value).splitlines() == [
        "out: is a folder; name a file",
        "out/seed=1: holds a run already (result.json); name another folder",
    ]


def test_a_row_tells_the_run_by_its_seed_where_the_case_does_not() -> None:
    assert str(Run(load_scenario("mine.yaml"), 0)) == "mine seed=0"
    assert str(Run(load_scenario("mine.yaml", ["vary={}"]), 3)) == "mine seed 3"
    row = row_of(Run(load_scenario("mine.yaml"), 0), Done(0, None, "ValueError: no such joint", 1.0))
    assert isinstance(row, Row)
    assert (row.outcome, row.why) == ("internal_error", "internal_error: ValueError: no such joint")


def test_a_line_of_the_progress_says_why() -> None:
    run = Run(load_scenario("mine.yaml"), 0)
    died = row_of(run, Done(0, None, "ValueError: no such joint", 1.0))
    assert summary(died) == "internal_error, not as expected (internal_error)"
    touched = replace(
        died, outcome="success", cause=None, unmet=["unintended_force"], wall_seconds=2.0, sim_seconds=8.0
    )
    told = "success, not as expected (not met: unintended_force), 8.0 s simulated, 0.00 x real time"
    assert summary(touched) == told
