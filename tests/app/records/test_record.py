import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from regrasp.app.files.findings import Findings
from regrasp.app.files.whole_file import write_whole
from regrasp.app.records.record import Record
from regrasp.app.records.result import Attempt, Link, Result
from regrasp.app.task.expectation import Expectation
from regrasp.interfaces.cause import Cause, CauseCode

FIELDS = [
    *(
        "schema",
        "scenario",
        "seed",
        "outcome",
        "succeeded",
        "task",
        "case",
        "cause",
        "chain",
        "traceback",
        "expectations",
    ),
    *("measured", "sim_seconds", "wall_seconds", "real_time_factor", "wall_by_part", "longest_tick"),
    *("renderer", "versions", "belief", "attempts"),
]


def test_the_documentation_names_every_field() -> None:
    told = (Path(__file__).parents[3] / "app" / "records" / "RECORD.md").read_text()
    kinds = (Result, Cause, Link, Expectation, Attempt)
    fields = [field.name for kind in kinds for field in dataclasses.fields(kind)]
    assert [name for name in fields if f"`{name}`" not in told] == []


def a_result() -> Result:
    return Result(
        scenario="short_obstacle",
        seed=3,
        outcome="failure",
        succeeded=False,
        cause=Cause(CauseCode.OUT_OF_REACH, "0.82 m from the right arm, reach 0.75 m", "root/regrasp/reach"),
        expectations=(
            Expectation("unintended_force", False, np.float64(7.5), 5.0),
            Expectation("x", True, np.inf, None),
        ),
        measured={"lit": np.float64(2.5)},
        sim_seconds=12.5,
    )


def test_the_result_file_has_exactly_its_fields(tmp_path: Path) -> None:
    with Record(tmp_path / "a" / "run", "short_obstacle", 3) as record:
        record.finish(a_result())
    read = json.loads((tmp_path / "a" / "run" / "result.json").read_text())
    assert list(read) == FIELDS
    assert read["schema"] == 3
    assert read["cause"] == {
        "code": "out_of_reach",
        "message": "0.82 m from the right arm, reach 0.75 m",
        "node": "root/regrasp/reach",
    }
    assert read["expectations"][0] == {"name": "unintended_force", "met": False, "value": 7.5, "limit": 5.0}
    assert read["expectations"][1]["value"] is None  # JSON has no infinity
    assert read["measured"] == {"lit": 2.5}
    assert {"python", "py_trees", "pybullet", "numpy", "opencv", "ompl"} <= set(read["versions"])


def test_events_carry_simulated_time_and_nothing_of_the_wall_clock(tmp_path: Path) -> None:
    def events(folder: Path) -> str:
        clock = [0.0]
        with Record(folder, "s", 1) as record:
            log = record.logger(lambda: clock[0]).bind(node="root/carry")
            log.info("grasped", gap=np.float64(0.02))
            clock[0] = 1.25
            log.warning("slipped", by="fingers")
        return (folder / "events.jsonl").read_text()

    text = events(tmp_path / "1")
    assert [json.loads(line) for line in text.splitlines()] == [
        {"t": 0.0, "level": "info", "event": "grasped", "node": "root/carry", "gap": 0.02},
        {"t": 1.25, "level": "warning", "event": "slipped", "node": "root/carry", "by": "fingers"},
    ]
    assert events(tmp_path / "2") == text


@pytest.mark.parametrize(
    ("error", "outcome"), [(KeyboardInterrupt(), "interrupted"), (ValueError("no such joint"), "internal_error")]
)
def test_a_run_cut_short_leaves_a_whole_record(tmp_path: Path, error: BaseException, outcome: str) -> None:
    record = Record(tmp_path / "run", "tall_obstacle", 7)
    record.ticks.write('{"t": 0.0}\n')
    with pytest.raises(type(error)), record:
        raise error
    read = json.loads((tmp_path / "run" / "result.json").read_text())
    assert (read["outcome"], read["scenario"], read["seed"], read["succeeded"]) == (outcome, "tall_obstacle", 7, False)
    assert str(error) in read["cause"]["message"]
    assert (outcome == "internal_error") == ("Traceback" in str(read["traceback"]))
    assert (tmp_path / "run" / "ticks.jsonl").read_text() == '{"t": 0.0}\n'
    assert record.ticks.closed
    assert record.events.closed
    kept = ["events.jsonl", "result.json", "signals.f32", "ticks.jsonl"]
    assert sorted(p.name for p in (tmp_path / "run").iterdir()) == kept


def test_a_result_given_before_the_interrupt_is_kept(tmp_path: Path) -> None:
    record = Record(tmp_path, "s", 1)
    record.finish(a_result())
    with pytest.raises(KeyboardInterrupt), record:
        raise KeyboardInterrupt
    assert json.loads((tmp_path / "result.json").read_text())["outcome"] == "failure"


def test_copies_of_what_is_run_are_there_from_the_beginning(tmp_path: Path) -> None:
    Record(tmp_path, "s", 1, copies={"tree.xml": "<root/>"}).ticks.close()
    assert (tmp_path / "tree.xml").read_text() == "<root/>"


@pytest.mark.parametrize("name", ["result.json", "events.jsonl", "ticks.jsonl", "tree.xml"])
def test_a_folder_that_holds_a_run_is_refused_and_left_alone(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("mine")
    with pytest.raises(Findings, match=f"holds .*{name}.*; name another folder"):
        Record(tmp_path, "s", 1)
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [(name, "mine")]


def test_without_a_folder_all_stays_in_memory() -> None:
    with Record(None, "s", 1) as record:
        record.logger(lambda: 2.0).info("found")
        record.finish(a_result())
    assert json.loads(record.events.getvalue())["event"] == "found"  # type: ignore[attr-defined]
    assert record.result == a_result()


def test_a_link_is_written_through_and_a_mode_kept(tmp_path: Path) -> None:
    (tmp_path / "real").write_text("old")
    (tmp_path / "real").chmod(0o600)
    (tmp_path / "link").symlink_to("real")
    write_whole(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "new"
    assert (tmp_path / "real").stat().st_mode & 0o777 == 0o600
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link", "real"]


def test_a_device_stays_a_device() -> None:
    write_whole(Path("/dev/null"), "gone")
    assert Path("/dev/null").is_char_device()


def test_of_two_runs_that_take_a_folder_at_once_the_second_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "regrasp.app.records.record.folders.run_folder_findings", lambda _folder: []
    )  # as both saw it before either began
    first = Record(tmp_path / "run", "s", 1)
    with pytest.raises(Findings, match=r"run: holds a run already \(events.jsonl, .*\); name another folder"):
        Record(tmp_path / "run", "s", 2)
    with first:
        pass
    assert json.loads((tmp_path / "run/result.json").read_text())["seed"] == 1
