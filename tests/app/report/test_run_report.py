"""The page of a run: what it shows, what it refuses, and what it does with a record that is damaged or means harm."""

import json
import os
import re
import shutil
import stat
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from report_records import HOSTILE, rich_record
from toy_record import kill, write_record
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.app.records.reader import read_record
from regrasp.app.report.curves import half_axes, panels
from regrasp.app.report.run_report import run_page
from regrasp.app.report.written import FollowParameters, follow_run


@pytest.fixture(scope="module")
def rich(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A record with all that a page shows."""
    return rich_record(tmp_path_factory.mktemp("records") / "rich")


@pytest.fixture
def copy(rich: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy to be damaged, named by a relative path."""
    monkeypatch.chdir(tmp_path)
    return Path(shutil.copytree(rich, "run"))


def typed(*words: object) -> Any:
    return CliRunner().invoke(app, ["report", *map(str, words)])


def test_a_page_says_what_was_asked_what_came_out_and_why(rich: Path) -> None:
    content, found = run_page(rich)
    text = content.decode()
    assert found == []
    for told in (
        "toy, seed 7",
        "Failure",
        "The part is to be fetched.",
        "jaw_opens: seconds 1\N{NO-BREAK SPACE}s; when at 0.4 to 0.6\N{NO-BREAK SPACE}s",
        "1 of 2 expectations met",
        "regrasp run scenario.yaml --seed 7",
        "slip: the connector is lost",
        "Planned again",
        "because fetch failed",
        "root/mission/tries/one/try/grasp",
    ):
        assert told in text, told
    assert text.count('class="new"') == 1  # the action that the first plan did not have
    assert text.count("data:image/jpeg;base64,") == 2
    assert "What is missing" not in text
    assert not re.search(r"(src|href)=\"(?!data:|#)", text)
    assert not re.search(r"<[^>]+ style=", text)  # the page's policy forbids them


def test_the_same_record_gives_the_same_bytes_wherever_it_lies(rich: Path, copy: Path) -> None:
    assert run_page(rich)[0] == run_page(copy)[0]


def test_curves_are_in_the_units_that_they_name(rich: Path) -> None:
    signals = read_record(rich).signals()
    assert signals is not None
    made = {panel.title: panel for panel in panels(signals)}
    [gap] = made["Gap between the pads"].curves
    assert gap.values[0] == pytest.approx(50.0)  # mm
    [distance] = made["Distance of the hands to the thing"].curves
    assert distance.values[0] == pytest.approx(0.3)
    [speed] = made["Fastest joint"].curves
    assert speed.values[1:] == pytest.approx(0.2, abs=1e-4)
    [error] = made["Error of the estimated position"].curves
    assert error.t.tolist() == [0.5, 1.5]
    assert error.values == pytest.approx([5.0, 5.0], abs=1e-3)
    assert error.region == pytest.approx(2.0 * np.sqrt(7.815) * np.ones(2), rel=1e-3)  # mm


def test_the_region_s_half_axis_is_that_of_the_largest_variance() -> None:
    triangle = np.zeros((1, 21))
    triangle[0, [0, 6, 11]] = 1e-6, 9e-6, 4e-6  # m2, on the diagonal of the position's block
    assert half_axes(triangle) == pytest.approx([3e-3 * np.sqrt(7.815)])


def test_hostile_texts_stay_texts(tmp_path: Path) -> None:
    text = run_page(rich_record(tmp_path / "run", hostile=True))[0].decode()
    assert "<script>window" not in text
    assert "{{7*7}}" in text  # no template of a template
    assert "\u202e" not in text
    assert "\x1b" not in text
    assert len(HOSTILE) > 10_000
    assert "x" * 2100 not in text


def test_an_old_record_is_shown_without_what_it_has_not(tmp_path: Path) -> None:
    text = run_page(write_record(tmp_path / "run"))[0].decode()
    for told in ("there are no curves", "the run kept no pictures", "scenario.yaml"):
        assert told in text, told
    assert "<video" not in text


def test_a_killed_run_names_what_was_at_work(copy: Path) -> None:
    kill(copy)
    told = typed(copy)
    assert told.exit_code == 0
    text = (copy / "report.html").read_text()
    assert "At work when the record ends" in text
    assert "there is no result.json: the run was killed, or still goes on" in text


@pytest.mark.parametrize("name", ["result.json", "events.jsonl", "ticks.jsonl", "signals.f32"])
@pytest.mark.parametrize("content", [b"", b"\xff\xfe not text\n", b'{"schema"'])
def test_what_can_be_read_of_a_damaged_record_is_shown(copy: Path, name: str, content: bytes) -> None:
    (copy / name).write_bytes(content)
    told = typed(copy)
    text = (copy / "report.html").read_text()
    assert "toy" in text or name == "events.jsonl"
    no_tick = name == "ticks.jsonl" and not content  # a run may end before its first
    assert told.exit_code == (0 if no_tick else 2)
    assert no_tick or name in told.stderr
    assert "Traceback" not in told.output


@pytest.mark.parametrize("name", ["scenario.yaml", "tree.xml", "cell.yaml", "pictures/0000.50-rear-slip.jpg"])
def test_files_beside_the_record_may_be_broken(copy: Path, name: str) -> None:
    (copy / name).write_bytes(b"\xff\x00{[")
    assert typed(copy).exit_code == (2 if name in ("scenario.yaml", "tree.xml") else 0)
    assert name == "cell.yaml" or name.rpartition("/")[2] in (copy / "report.html").read_text()


def test_the_page_of_a_run_that_goes_on_loads_itself_anew_until_it_ends(copy: Path) -> None:
    page, result = copy / "live.html", (copy / "result.json").read_bytes()
    (copy / "result.json").unlink()
    pages = follow_run(copy, page, FollowParameters(every=1))
    next(pages)
    text = page.read_text()
    assert '<meta http-equiv="refresh" content="1">' in text
    assert "What it does now" in text
    assert "result.json" not in text
    (copy / "result.json").write_bytes(result)
    assert next(pages).page == page
    assert 'http-equiv="refresh"' not in page.read_text()
    assert next(pages, None) is None


def test_a_run_that_fell_silent_is_not_followed(copy: Path) -> None:
    (copy / "result.json").unlink()
    for file in copy.rglob("*"):
        os.utime(file, (1e9, 1e9))
    assert typed(copy, "--follow").exit_code == 0
    assert 'http-equiv="refresh"' not in (copy / "report.html").read_text()


def test_what_was_found_is_drawn_into_its_picture(copy: Path) -> None:
    name = next((copy / "pictures").glob("*.jpg")).name
    found = {"picture": name, "found": "part <b>here</b>", "outline": [[8.0, 6.0], [16.0, 6.0], [16.0, 12.0]]}
    lines = [found, {"picture": name, "found": "no outline"}, {"picture": "gone.jpg", "found": "x", "outline": []}]
    (copy / "pictures/outlines.jsonl").write_text("\n".join([*map(json.dumps, lines), "{"]))
    text = run_page(copy)[0].decode()
    [points] = re.findall(r'<polygon class="found" points="([^"]+)"><title>part &lt;b&gt;here', text)
    assert points == "8.0,6.0 16.0,6.0 16.0,12.0"
    assert "outlines.jsonl: 2 lines cannot be read" in text


def test_a_result_of_a_later_version_is_refused(copy: Path) -> None:
    (copy / "result.json").write_text(json.dumps({"schema": 9}))
    told = typed(copy)
    assert told.exit_code == 2
    assert told.stderr == (
        "run/result.json:1: schema 9 is newer than 3, which this program reads; take a newer Regrasp\n"
    )
    assert not (copy / "report.html").exists()


def test_bad_input_is_a_line_and_writes_nothing(copy: Path) -> None:
    (copy / "taken.html").write_text("mine")
    Path("empty").mkdir()
    for words, line in (
        ((copy, "-o", "run/taken.html"), "run/taken.html: exists already; name another file with -o, or write --force"),
        ((copy, "-o", "run/result.json", "--force"), "is the name of a record's own file"),
        ((copy, "-o", "empty"), "empty: is a folder; name a file"),
        (("empty",), "empty: holds no run"),
        (("nowhere",), "nowhere: does not exist"),
        (("nowhere", "--follow"), "nowhere: does not exist"),
        ((copy, "--against", "empty"), "--against: is for campaigns"),
        ((copy, "--runs"), "--runs: is for campaigns"),
    ):
        told = typed(*words)
        assert (told.exit_code, told.stdout) == (2, ""), words
        assert line in told.stderr
        assert told.stderr.count("\n") == 1
    assert (copy / "taken.html").read_text() == "mine"
    assert typed(copy, "-o", copy / "taken.html", "--force").exit_code == 0
    assert (copy / "taken.html").read_text() != "mine"


@pytest.mark.skipif(os.getuid() == 0, reason="root may write everywhere")
def test_a_folder_that_cannot_be_written_is_a_line(copy: Path) -> None:
    copy.chmod(stat.S_IRUSR | stat.S_IXUSR)
    told = typed(copy)
    assert told.exit_code == 2
    assert "cannot write in 'run'" in told.stderr
