from pathlib import Path

import pytest
from toy_record import kill, write_record
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.app.records.diff import beginnings, differences
from regrasp.app.records.reader import read_record


def differ(a: Path, b: Path) -> list[str]:
    return differences(read_record(a), read_record(b))


def test_the_wall_clock_makes_no_difference(tmp_path: Path) -> None:
    runs = [write_record(tmp_path / name, wall_seconds=seconds) for name, seconds in (("a", 1.0), ("b", 2.0))]
    assert differ(*runs) == []


def test_what_was_run_and_how_it_ended_are_compared(tmp_path: Path) -> None:
    a = write_record(tmp_path / "a", versions={"numpy": "2.0", "python": "3.11"})
    b = write_record(
        tmp_path / "b",
        seed=8,
        outcome="success",
        succeeded=True,
        cause=None,
        versions={"numpy": "2.1", "python": "3.11"},
    )
    assert beginnings(read_record(a), read_record(b)) == ["seed: 7 | 8", "versions.numpy: 2.0 | 2.1"]
    assert differ(a, b) == [
        "outcome: failure | success",
        "succeeded: False | True",
        "cause.code: slipped | -",
        "cause.message: grasp 1 mm | -",
        "cause.node: grasp | -",
    ]


def test_the_first_reading_that_differs_is_named(tmp_path: Path) -> None:
    runs = [write_record(tmp_path / name, gap=gap) for name, gap in (("a", 0.0443), ("b", 0.05))]
    assert differ(*runs) == [
        "first differing event at 0.50 s: root/mission/tries/one/try/grasp slip",
        "  value: 0.0443 | 0.05",
    ]


def test_the_first_tick_that_differs_is_told_by_its_deepest_node(tmp_path: Path) -> None:
    a, b = (write_record(tmp_path / name) for name in ("a", "b"))
    text = (b / "ticks.jsonl").read_text().splitlines(keepends=True)
    failed = [line for line in text if not ('"t": 0.5' in line and ("/try" in line))]
    (b / "ticks.jsonl").write_text("".join(failed))
    assert differ(a, b) == ["first differing tick at 0.50 s: root/mission/tries/one/try/grasp: FAILURE | RUNNING"]


def test_an_end_like_the_one_before_counts(tmp_path: Path) -> None:
    a, b = (write_record(tmp_path / name) for name in ("a", "b"))
    text = (b / "ticks.jsonl").read_text().splitlines(keepends=True)
    again = '{"t": 1.0, "path": "root/mission/tries/one/try/grasp", "status": "FAILURE"}\n'
    assert again in text
    (b / "ticks.jsonl").write_text("".join(line for line in text if line != again))
    assert differ(a, b) == [
        "first differing tick at 1.00 s: root/mission/tries/one/try/grasp FAILURE | root/stop RUNNING"
    ]


def test_a_run_that_goes_on_where_the_other_was_killed(tmp_path: Path) -> None:
    a, b = (write_record(tmp_path / name) for name in ("a", "b"))
    kill(b)
    told = differ(a, b)
    assert "outcome: failure | -" in told
    assert "first differing tick at 1.00 s: root/mission/tries: FAILURE | RUNNING" in told


@pytest.mark.parametrize(
    ("other", "code", "told"),
    [
        ("a", 0, "the same 24 lines of ticks and 2 events\n"),
        ("seed 9", 0, "a | seed 9\nseed: 7 | 9\nthe same 24 lines of ticks and 2 events\n"),
        ("gap", 1, "a | gap\nfirst differing event"),
        ("nowhere", 2, ""),
    ],
)
def test_the_exit_code_says_whether_they_went_the_same_way(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, other: str, code: int, told: str
) -> None:
    monkeypatch.chdir(tmp_path)
    write_record(Path("a"))
    write_record(Path("seed 9"), seed=9)
    write_record(Path("gap"), gap=0.05)
    ran = CliRunner().invoke(app, ["diff", "a", other])
    assert ran.exit_code == code
    assert ran.stdout.startswith(told)
    assert ran.stderr.startswith("nowhere: does not exist" if code == 2 else "")
