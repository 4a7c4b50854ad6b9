"""`regrasp campaign`: what a user types and sees. The runs themselves are scripted but for one."""

import csv
import io
import json
import os
import shutil
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from typer.testing import CliRunner

from regrasp.app.campaigns.campaign import Local, do_all
from regrasp.app.campaigns.episodes import KIND, Stored, jobs_of
from regrasp.app.campaigns.plan import planned
from regrasp.app.campaigns.progress import Progress
from regrasp.app.campaigns.store import NewRow, Store
from regrasp.app.cli.campaign_output import print_cases
from regrasp.app.cli.commands import app
from regrasp.app.records.record import Record
from regrasp.app.records.result import Result
from regrasp.app.records.summary import run_summary
from regrasp.app.run.batch import Settings
from regrasp.app.scenario.load import Scenario
from regrasp.app.task.expectation import Expectation
from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cause import Cause


def before(scenario: Scenario, out: Path | None, *, seed: int, video: bool, renderer: str) -> Result:
    """Every third seed fails by a search in vain, seed 1 on Earth by a crash."""
    if seed == 1 and scenario.file.gravity == "earth":
        os._exit(9)
    return _result(scenario, out, seed, failed=seed % 3 == 0, seconds=60.0 + seed)


def after(scenario: Scenario, out: Path | None, *, seed: int, video: bool, renderer: str) -> Result:
    """Seed 4 alone fails; all take 5 s less."""
    return _result(scenario, out, seed, failed=seed == 4, seconds=55.0 + seed)


def _result(scenario: Scenario, out: Path | None, seed: int, failed: bool, seconds: float) -> Result:
    cause = Cause(CableCause.SEARCH_EXHAUSTED, "18 stops", "recovery/search") if failed else None
    result = Result(
        scenario.name,
        seed,
        "failure" if failed else "success",
        succeeded=not failed,
        task="cable",
        case=scenario.case,
        cause=cause,
        expectations=(Expectation("outcome", not failed, "failure" if failed else "success", "success"),),
        sim_seconds=seconds,
        wall_seconds=seconds / 3,
        real_time_factor=3.0,
    )
    with Record(out, scenario.name, seed, scenario.case, task="cable") as record:
        record.finish(result)
    return result


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two campaigns of twelve runs, a and b."""
    place = tmp_path_factory.mktemp("campaigns")
    for name, episode in (("a", before), ("b", after)):
        runs = planned("no_obstacle", seeds=range(6))
        with Store.create(place / name, KIND) as store:
            jobs = jobs_of(runs, Settings(), episode)
            do_all(jobs, store, Local(1), Stored(runs, "failed"), Progress(quiet=True))
    return place


def typed(folder: Path, monkeypatch: pytest.MonkeyPatch, *words: str) -> tuple[int, str, str]:
    """The exit code, stdout and stderr of a command in the folder."""
    monkeypatch.chdir(folder)
    ran = CliRunner().invoke(app, ["campaign", *words])
    return ran.exit_code, ran.stdout, ran.stderr


def test_show(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    code, out, err = typed(folder, monkeypatch, "show", "a")
    assert (code, err) == (0, "")
    assert [line.split()[:3] for line in out.splitlines()] == [
        ["case", "as", "expected"],
        ["no_obstacle", "gravity=earth", "3/6"],
        ["no_obstacle", "gravity=zero", "4/6"],
        ["all", "7/12", "32.0"],  # Wilson's interval
        ["no_obstacle", "gravity=earth:", "2"],
        ["no_obstacle", "gravity=earth:", "1"],
        ["no_obstacle", "gravity=zero:", "2"],
    ]
    assert out.splitlines()[4:6] == [
        "no_obstacle gravity=earth: 2 x search_exhausted",
        "no_obstacle gravity=earth: 1 x internal_error",
    ]
    assert out.splitlines()[0].endswith("wall s, 50 %")
    told = json.loads(typed(folder, monkeypatch, "show", "a", "--json")[1])
    assert (told["schema"], told["runs"], told["succeeded"]) == (1, 12, 7)
    assert told["cases"][1]["causes"] == {"search_exhausted": 2}
    assert told["cases"][1]["sim_seconds"] == [60.0, 62.0, 65.0]
    rows = [*csv.DictReader(io.StringIO(typed(folder, monkeypatch, "show", "a", "--csv")[1]))]
    assert [row["row"] for row in rows] == [str(n + 1) for n in range(12)]
    assert sorted({row["cause"] for row in rows}) == ["", "internal_error", "search_exhausted"]
    assert all(
        (folder / "a" / row["record"]).is_dir() == (row["succeeded"] == "False") for row in rows if row["record"]
    )


def test_junit(folder: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    code, _, _ = typed(folder, monkeypatch, "show", "a", "--junit", str(tmp_path / "a.xml"))
    [suite] = ET.parse(tmp_path / "a.xml").getroot()
    assert (code, suite.attrib["tests"], suite.attrib["failures"], suite.attrib["errors"]) == (0, "12", "4", "1")
    assert "no_obstacle gravity=zero, seed 0: failure" in (suite[0][0].text or "")


def test_failures(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    code, out, _ = typed(folder, monkeypatch, "failures", "a")
    assert code == 0
    assert out.splitlines()[0] == "4 x search_exhausted at recovery/search"
    assert "no_obstacle gravity=zero seed 0: search_exhausted: 18 stops" in out
    assert "in full, a/runs/no_obstacle-gravity=zero-0:" in out
    assert "1 x internal_error\n" in out
    assert "the process died with exit code 9" in out


def test_compare(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    code, out, _ = typed(folder, monkeypatch, "compare", "a", "b")
    assert code == 0
    assert out.splitlines()[:3] == ["12 scenes in both", "as expected: 7 in A, 10 in B", "better in B: 5"]
    assert "worse in B: 2\n  no_obstacle gravity=zero seed 4\n" in out
    assert "exact McNemar test: p = 0.453: chance can explain it" in out
    assert "B takes -5.00 (95 % interval -5.00 to -5.00)" in out
    told = json.loads(typed(folder, monkeypatch, "compare", "a", "b", "--json")[1])
    assert (told["scenes"], len(told["better"]), len(told["worse"])) == (12, 5, 2)


def test_rerun_does_a_real_run(folder: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    runs = planned("no_obstacle", ["limits.sim_seconds=0.5", "gravity=earth"], range(3, 4))
    with Store.create(tmp_path / "c", KIND) as store:
        do_all(jobs_of(runs, Settings()), store, Local(1), Stored(runs, "all"), Progress(quiet=True))
    code, out, err = typed(tmp_path, monkeypatch, "rerun", "c", "1", "--out", "again", "--quiet")
    assert code == 1  # the time limit
    assert err == ""
    assert "no_obstacle gravity=earth, seed 3: time_limit" in out
    for name in ("ticks.jsonl", "events.jsonl"):
        first = tmp_path / "c/runs/no_obstacle-gravity=earth-3" / name
        assert first.read_bytes() == (tmp_path / "again" / name).read_bytes()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("show none", "none: does not exist; name a folder that regrasp campaign made"),
        ("show a@7", "a@7: no version 7 with runs; there is @1"),
        ("show a --json --csv", "--csv: is for CSV, and --json for JSON; leave one of them out"),
        ("rerun a 99", "a: no row 99; `regrasp campaign show a --csv` lists them"),
        ("nothing", "nothing: no scenario named 'nothing'"),
        ("no_obstacle --seeds 3:1 --out new", "--seeds: '3:1' is no range of seeds"),
        ("no_obstacle --engine dask", "--scheduler: missing; name one with --scheduler"),
        ("no_obstacle --scheduler tcp://h:1", "--scheduler: is for Dask; write --engine dask"),
        ("no_obstacle --out .", "holds other things (a, b); name a folder of its own"),
        ("no_obstacle --engine dask --scheduler tcp://127.0.0.1:1 --out new", "no scheduler answers at"),
    ],
)
def test_bad_input(folder: Path, monkeypatch: pytest.MonkeyPatch, words: str, told: str) -> None:
    code, out, err = typed(folder, monkeypatch, *words.split())
    assert (code, out) == (2, "")
    assert told in err
    assert sorted(path.name for path in folder.iterdir()) == ["a", "b"]


def test_less_than_required(folder: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    words = [
        "no_obstacle",
        "--set",
        "limits.sim_seconds=0.2",
        "--set",
        "gravity=zero",
        "--seeds",
        "0:1",
        "--keep",
        "none",
    ]
    code, out, err = typed(tmp_path, monkeypatch, *words, "--quiet", "--require", "0.5")
    assert code == 1
    assert "below the required 50.0 %" in err
    assert "0/1" in out
    code, _, err = typed(tmp_path, monkeypatch, *words)
    assert code == 0
    assert "1 of 1 are done already" in err
    assert "note" not in err
    again = [word for word in words if word not in ("--seeds", "0:1", "none")]
    code, _, err = typed(tmp_path, monkeypatch, *again, "all")
    assert code == 0
    assert err.splitlines()[-3:] == [
        "note: one seed each: --seeds 0:100 asks for more",
        "note: --keep all changes nothing in the 1 that are done already; "
        "`regrasp campaign rerun results/no_obstacle 1` makes a record of one",
        "1 of 1 are done already",
    ]
    _, _, err = typed(tmp_path, monkeypatch, *words, "--pictures")
    assert "`regrasp campaign rerun results/no_obstacle 1 --pictures` makes a record of one" in err
    assert sorted(path.name for path in (tmp_path / "results/no_obstacle").iterdir()) == [
        "campaign.db",
        "campaign.lock",
    ]


def test_what_is_no_campaign_to_show(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "tiny.yaml").touch()
    (tmp_path / "new").mkdir()
    (tmp_path / "new/campaign.db").touch()
    assert typed(tmp_path, monkeypatch, "show", "tiny.yaml")[2] == "tiny.yaml: is a file; name a campaign's folder\n"
    assert typed(tmp_path, monkeypatch, "show", "new")[2] == "new: holds no run yet; wait for the first\n"


def test_a_folder_whose_name_ends_like_a_version(folder: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    shutil.copytree(folder / "a", tmp_path / "a@2")
    for name in ("a@2", "a@2@1"):
        code, out, _ = typed(tmp_path, monkeypatch, "show", name)
        assert (code, "7/12" in out) == (0, True)


def test_show_of_one_version_of_two(folder: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The second has a row whose texts could steer a terminal."""
    shutil.copytree(folder / "a", tmp_path / "a")
    with Store.create(tmp_path / "a", KIND) as store:
        value = next(store.rows(1)).value
        odd = {"code": "internal_error", "message": "a\x1b[31m", "node": "b\x1b\n"}
        value |= {"why": "a\x1b[31m\nb", "cause": odd}
        store.add(NewRow(store.version_id("other", {"python": "4"}), "key", "odd", value))
    _, _, err = typed(tmp_path, monkeypatch, "show", "a@1")
    assert err.startswith("note: 1 more here are of newer sources, packages or scenarios, from 2")
    assert err.endswith("; `regrasp campaign show a@2` shows those\n")
    _, out, err = typed(tmp_path, monkeypatch, "show", "a", "--csv")
    [row] = csv.DictReader(io.StringIO(out))
    assert (row["why"], row["node"]) == (r"a\x1b[31m\nb", r"b\x1b\n")
    _, _, err = typed(tmp_path, monkeypatch, "show", "a")
    assert err.startswith("note: 12 more here are of older sources, packages or scenarios, from 2")


def test_a_cause_steers_no_terminal() -> None:
    cause = Cause(CableCause.SEARCH_EXHAUSTED, "a\x1b[31m\nb", "c")
    result = Result("s", 0, "failure", succeeded=False, task="cable", case="", cause=cause)
    assert r"cause   search_exhausted: a\x1b[31m\nb (c)" in run_summary(result, Path("r"))


def test_no_table_without_runs(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """As after Ctrl-C before the first run has ended."""
    with Store.create(tmp_path / "c", KIND) as store:
        assert print_cases(store, 1) == 0.0
    assert capsys.readouterr().out == ""


def test_help_fits(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert "..." not in typed(tmp_path, monkeypatch, "--help")[1].partition("Commands:")[2]
    assert "{DIR} {ROW}" in typed(tmp_path, monkeypatch, "rerun", "--help")[1]
    assert "(0 if it names none)" in " ".join(typed(tmp_path, monkeypatch, "run", "--help")[1].split())
