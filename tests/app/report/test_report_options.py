"""`--report` of `regrasp run` and `regrasp campaign`, and the plugin's link. Toy runs stand in for real ones."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from toy_record import write_record
from typer.testing import CliRunner

import regrasp
from regrasp.app.campaigns.campaign import Local, do_all
from regrasp.app.campaigns.episodes import KIND, Stored, jobs_of
from regrasp.app.campaigns.plan import planned
from regrasp.app.campaigns.progress import Progress
from regrasp.app.campaigns.store import Store
from regrasp.app.cli.commands import app
from regrasp.app.cli.run import tell_report
from regrasp.app.cli.run_every import run_every
from regrasp.app.pytest_plugin import _reported
from regrasp.app.records.reader import read_record
from regrasp.app.records.result import Result
from regrasp.app.run.batch import Settings

WORDS = ["no_obstacle", "--set", "gravity=zero"]


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def toy_run(_scenario: Any, out: Path | None, **_: Any) -> Result:
    """Leaves the toy record."""
    assert out is not None
    result = read_record(write_record(out)).result
    assert result is not None
    return result


def test_a_run_writes_its_page_at_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    loaded = SimpleNamespace(name="toy", file=SimpleNamespace(seed=7))
    monkeypatch.setattr(regrasp, "load_scenario", lambda *_: loaded)
    monkeypatch.setattr(regrasp, "run", toy_run)
    ran = CliRunner().invoke(app, ["run", *WORDS, "--report", "--quiet", "--out", "one"])
    assert ran.exit_code == 1
    assert ran.stdout.splitlines()[-1].startswith("  report  one/report.html, 0.")
    assert "toy, seed 7" in Path("one/report.html").read_text()


def test_a_page_that_cannot_be_written_does_not_hide_how_a_run_ended(capsys: pytest.CaptureFixture[str]) -> None:
    (write_record(Path("one")) / "report.html").mkdir()
    tell_report(Path("one"))
    told = capsys.readouterr()
    assert (told.out, told.err) == (
        "",
        "no report: one/report.html: cannot write it: Is a directory; name another file\n",
    )


def test_every_case_has_its_page(capsys: pytest.CaptureFixture[str]) -> None:
    run_every("no_obstacle", [], 2, Path("all"), settings=Settings(quiet=True, report=True), episode=toy_run)
    assert capsys.readouterr().out.splitlines()[-1] == "reports: report.html in each record"
    assert len([*Path("all").glob("*/report.html")]) == 2


def test_a_campaign_writes_its_page_at_the_end_each_time() -> None:
    runs = planned("no_obstacle", ["gravity=zero"], range(1))
    with Store.create(Path("many"), KIND) as store:
        do_all(jobs_of(runs, Settings(), toy_run), store, Local(1), Stored(runs, "failed"), Progress(quiet=True))
    for _ in range(2):
        ran = CliRunner().invoke(app, ["campaign", *WORDS, "--seeds", "0:1", "--quiet", "--report", "--out", "many"])
        assert ran.exit_code == 0
        assert ran.stdout.splitlines()[-1].startswith("report: many/report.html, 0.")
    assert "0 of 1" in Path("many/report.html").read_text()


def test_a_failed_case_of_a_suite_names_its_page(tmp_path: Path) -> None:
    assert _reported(write_record(tmp_path / "run")) == tmp_path / "run/report.html"
    assert _reported(tmp_path / "nothing") is None
