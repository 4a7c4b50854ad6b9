"""The page of a campaign, of runs that are scripted."""

import json
import shutil
import sqlite3
from pathlib import Path
from typing import Any

import pytest
from report_records import HOSTILE, rich_record
from typer.testing import CliRunner

from regrasp.app.campaigns.campaign import version_of
from regrasp.app.campaigns.episodes import KIND
from regrasp.app.campaigns.store import NewRow, Store
from regrasp.app.cli.commands import app
from regrasp.app.report.campaign_report import campaign_page
from regrasp.app.report.figures_of_runs import figures, strange
from regrasp.app.report.knobs import knobs
from regrasp.app.run.batch import Row


def row(seed: int, failed: bool, words: str = "18 stops", **changes: Any) -> dict[str, Any]:
    """The values of a stored run."""
    brightness = 0.5 if seed % 2 else 1.0
    return {
        "scenario": "toy",
        "case": f"light.brightness={brightness}",
        "gravity": "zero",
        "seed": seed,
        "outcome": "failure" if failed else "success",
        "succeeded": not failed,
        "cause": {"code": "search_exhausted", "message": words, "node": "root/search"} if failed else None,
        "peak_memory_mb": 100.0,
        "why": words if failed else "",
        "sim_seconds": 20.0 + seed % 5,
        "wall_seconds": 5.0,
        "task": "printer",
        "measured": {"door_open": 0.001 * seed, "slips": [{"at": 1.0}] * (seed % 3)},
        "source": {"scenario": "toy.yaml", "overrides": [], "scene": {"obstacles": float(seed)}},
        **changes,
    }


def write_campaign(folder: Path, runs: int, fails: Any, record: Path | None = None, **changes: Any) -> Path:
    """A campaign whose runs with odd seeds and `fails(seed)` failed; the first failed one has a record."""
    with Store.create(folder, KIND) as store:
        version = version_of(store)
        for seed in range(runs):
            value = row(seed, fails(seed), **changes)
            kept = ""
            if record is not None and fails(seed):
                kept, record = f"runs/toy-{seed}", shutil.copytree(record, folder / f"runs/toy-{seed}") and None
            store.add(NewRow(version, f"key {seed}", f"toy seed {seed}", value, kept))
    return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two campaigns of forty runs: in `a` all with odd seeds fail, in `b` every tenth."""
    place = tmp_path_factory.mktemp("campaigns")
    record = rich_record(place / "record")
    write_campaign(place / "a", 40, lambda seed: seed % 2 == 1, record)
    write_campaign(place / "b", 40, lambda seed: seed % 10 == 0)
    return place


def typed(*words: object) -> Any:
    return CliRunner().invoke(app, ["report", *map(str, words)])


def test_a_page_says_how_often_why_and_what_decides(folder: Path) -> None:
    text = campaign_page(str(folder / "a")).decode()
    for told in (
        "20 of 40",
        "35.2 % to 64.8 % with 95 %",
        "search_exhausted",
        'id="run-2"',
        "light.brightness",
        "door_open (m)",
        "number of slips",
        "What so many runs cannot tell",
        "these 40 scenes, run again after it",
        "regrasp report runs/toy-1",
    ):
        assert told in text, told
    assert campaign_page(str(folder / "a")).decode() == text


def test_reports_of_failed_runs_are_written_and_linked(folder: Path, tmp_path: Path) -> None:
    place = Path(shutil.copytree(folder / "a", tmp_path / "a"))
    assert typed(place, "--runs").exit_code == 0
    assert (place / "runs/toy-1/report.html").is_file()
    assert 'href="runs/toy-1/report.html"' in (place / "report.html").read_text()


def test_two_campaigns_side_by_side(folder: Path, tmp_path: Path) -> None:
    told = typed(folder / "b", "--against", folder / "a", "-o", tmp_path / "x.html")
    assert told.exit_code == 0
    text = (tmp_path / "x.html").read_text()
    assert "Better here: 20" in text
    assert "Worse here: 4" in text
    assert "more than chance" in text


def test_a_knob_whose_intervals_lie_apart_comes_first(folder: Path) -> None:
    with Store.read(folder / "a") as store:
        stored = [*store.rows(1)]
    rows = [Row(**{k: v for k, v in one.value.items() if k != "source"}) for one in stored]
    first, second = knobs(rows, stored)
    assert (first.name, first.apart, [one.succeeded for one in first.settings]) == ("light.brightness", True, [0, 20])
    assert (second.name, second.apart, [one.value for one in second.settings][:1]) == (
        "drawn: obstacles",
        False,
        ["0 to 7"],
    )


def test_a_run_far_from_the_others_is_strange() -> None:
    rows = [Row(**{k: v for k, v in row(seed, False).items() if k != "source"}) for seed in range(20)]
    rows.append(Row(**{k: v for k, v in row(20, False, sim_seconds=90.0).items() if k != "source"}))
    [found] = strange(figures(rows))
    assert (found.place, found.name, found.value) == (20, "simulated time (s)", 90.0)


def test_hostile_texts_of_a_campaign_stay_texts(tmp_path: Path) -> None:
    write_campaign(tmp_path / "c", 3, lambda _: True, words=HOSTILE, scenario=HOSTILE, case=HOSTILE, outcome=HOSTILE)
    text = campaign_page(str(tmp_path / "c")).decode()
    assert "<script>window" not in text
    assert "\u202e" not in text
    assert "\x1b" not in text


def test_a_single_run_and_one_without_times_make_a_page(tmp_path: Path) -> None:
    write_campaign(tmp_path / "c", 1, lambda _: True, wall_seconds=0.0, sim_seconds=0.0, measured={})
    assert b"0 of 1" in campaign_page(str(tmp_path / "c"))


def test_what_is_wrong_with_a_campaign_is_a_line(folder: Path, tmp_path: Path) -> None:
    Store.create(tmp_path / "none", KIND).__exit__()
    place = Path(shutil.copytree(folder / "a", tmp_path / "a"))
    with sqlite3.connect(place / "campaign.db") as database:
        database.execute("update row set value = ? where number = 1", (json.dumps({"seed": 1}),))
    later = Path(shutil.copytree(folder / "a", tmp_path / "later"))
    with sqlite3.connect(later / "campaign.db") as database:
        database.execute("pragma user_version = 9")
    for words, line in (
        ((tmp_path / "none",), "holds no run yet; wait for the first"),
        ((place,), "is damaged (row 1 holds no run's figures)"),
        ((later,), "schema 9 is newer than 1"),
        ((folder / "a", "--against", tmp_path / "none", "-o", tmp_path / "x.html"), "holds no run yet"),
        ((f"{folder / 'a'}@7", "-o", tmp_path / "x.html"), "no version 7 with runs"),
    ):
        told = typed(*words)
        assert (told.exit_code, told.stdout) == (2, ""), words
        assert line in told.stderr
    assert not (tmp_path / "x.html").exists()
    assert not (place / "report.html").exists()
