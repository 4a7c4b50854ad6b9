import json
import os
import time
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from toy_record import kill, write_record

from regrasp.app.files.findings import Findings
from regrasp.app.records.diff import differences
from regrasp.app.records.explain import explanation
from regrasp.app.records.reader import read_record
from regrasp.app.records.replay import Replay

FILES = ("result.json", "events.jsonl", "ticks.jsonl")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return write_record(Path("run"))


def findings(folder: Path) -> list[str]:
    with pytest.raises(Findings) as caught:
        read_record(folder)
    return [str(item) for item in caught.value.items]


def test_a_record_comes_back_as_it_was_written(folder: Path) -> None:
    record = read_record(folder)
    assert record.result is not None
    assert record.result.to_json() == (folder / "result.json").read_text()
    assert record.begin["seed"] == 7
    assert (record.ticks[0].path, record.ticks[0].status, record.remarks) == ("root", "RUNNING", ())
    assert [event.event for event in record.events] == ["begin", "slip"]
    assert record.events[1].values == {"by": "gap", "value": 0.0443}


def test_a_killed_run_is_read_as_far_as_it_goes_and_that_is_said(folder: Path) -> None:
    before = [tick for tick in read_record(folder).ticks if tick.t < 1.0]
    kill(folder)
    record = read_record(folder)
    assert record.result is None
    assert [*record.ticks] == before
    assert [remark.split(":")[0] for remark in record.remarks] == [
        "the last line of ticks.jsonl is half written",
        "there is no result.json",
    ]


@pytest.mark.parametrize("name", ["nowhere", "file", "empty"])
def test_what_holds_no_run_is_one_finding(folder: Path, name: str) -> None:
    Path("file").write_text("")
    Path("empty").mkdir()
    [told] = findings(Path(name))
    assert told.startswith(f"{name}: ")
    assert told.endswith("name a folder that regrasp run made")


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        (
            "ticks.jsonl",
            '{"t": 0.0, "path": "a", "status": "RUNNING"}\n{"t": 1.0, "path": "a"}\n',
            "ticks.jsonl:2: status",
        ),
        ("ticks.jsonl", '{"t": NaN, "path": "a", "status": "RUNNING"}\n', "ticks.jsonl:1: not JSON"),
        ("ticks.jsonl", '{"t": 1e999, "path": "a", "status": "RUNNING"}\n', "ticks.jsonl:1: t"),
        ("ticks.jsonl", '{"t": 0, "path": "a", "status": "DONE"}\n', "ticks.jsonl:1: status"),
        ("events.jsonl", '{"t": 2.0, "event": "a"}\n{"t": 1.0, "event": "b"}\n', "events.jsonl:2: t goes back"),
        ("events.jsonl", "[1]\n", "events.jsonl:1: no JSON object"),
        ("events.jsonl", '{"a":' * 100_000 + "\n", "events.jsonl:1: not JSON: recursion limit"),
        ("events.jsonl", "\x1b]0;mine\x07\n", "events.jsonl:1: not JSON"),
        ("result.json", '{\n "schema": 1,,\n}', "result.json:2: not JSON"),
        ("result.json", '{"schema": 4}', "result.json:1: schema 4 is newer than 3"),
        ("result.json", '{"scenario": "a"}', "result.json:1: no 'schema'"),
        ("result.json", '{"schema": 1, "scenario": "a"}', "result.json:1: seed"),
    ],
)
def test_what_is_broken_is_told_with_file_and_line(folder: Path, name: str, text: str, expected: str) -> None:
    (folder / name).write_text(text)
    [told] = findings(folder)
    assert told.startswith(f"run/{expected}")
    assert told.isprintable()


def test_all_that_is_wrong_is_told_at_once(folder: Path) -> None:
    (folder / "ticks.jsonl").unlink()
    (folder / "events.jsonl").write_text("?\n" * 50)
    (folder / "result.json").write_text("{}")
    told = findings(folder)
    assert len(told) == 12  # ten of the fifty, and one for each of the others
    assert "run/ticks.jsonl: is missing; a run leaves one" in told


def test_a_pipe_in_place_of_a_file_is_not_waited_for(folder: Path) -> None:
    (folder / "ticks.jsonl").unlink()
    os.mkfifo(folder / "ticks.jsonl")
    assert findings(folder) == ["run/ticks.jsonl: is no file; a run leaves one"]


def test_a_huge_file_is_refused_unread(folder: Path) -> None:
    with (folder / "events.jsonl").open("wb") as stream:
        stream.truncate(1 << 40)  # sparse
    assert findings(folder) == ["run/events.jsonl: longer than 64 MiB; no run leaves that much"]


def test_a_long_hostile_record_is_explained_in_seconds(folder: Path) -> None:
    value = json.loads((folder / "result.json").read_text())
    deep = {"started": 0.0, "ended": 0.0, "status": "FAILURE", "cause": None}
    value["attempts"] = [deep | {"path": f"{i}/" * 100 + str(i)} for i in range(5000)]
    (folder / "result.json").write_text(json.dumps(value))
    begin = time.process_time()
    assert "4500 earlier attempts are left out" in explanation(read_record(folder), 100)
    assert time.process_time() - begin < 20  # it takes one; what is quadratic takes minutes


def look(folder: Path) -> None:
    """All that looks at records, on a folder with anything in it: done, or findings."""
    try:
        record = read_record(folder)
        assert explanation(record, 80).replace("\n", "").isprintable()
        assert "\n".join(Replay(record, 9.0).lines(0.0, "")).replace("\n", "").isprintable()
        assert differences(record, record) == []
    except Findings:
        pass


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)


@settings(max_examples=60)
@given(data=st.data())
def test_a_result_with_any_value_in_any_field_ends_in_words(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = write_record(tmp_path_factory.mktemp("fuzz") / "run")
    value = json.loads((folder / "result.json").read_text())
    at = value
    while isinstance(at, (dict, list)) and at:
        key = data.draw(st.sampled_from([*at] if isinstance(at, dict) else range(len(at))))
        if not isinstance(at[key], (dict, list)) or data.draw(st.booleans()):
            at[key] = data.draw(json_values)
            break
        at = at[key]
    (folder / "result.json").write_text(json.dumps(value))
    look(folder)
