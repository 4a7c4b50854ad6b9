from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from toy_record import write_record

from regrasp.app.records.history import attempts, attempts_from_ticks
from regrasp.app.records.reader import Event, read_record
from regrasp.trees import NodeExecution, run_stats


def test_a_cause_is_told_by_the_event_of_the_failure() -> None:
    made = [NodeExecution("a/b", 0.0, 1.0, "FAILURE"), NodeExecution("a/stop", 1.0, 1.3, "FAILURE")]
    values = {"code": "slipped", "message": "gap 3 mm"}
    events = [Event(1.0, "failed", "a/b", values), Event(1.3, "failed", "a/stop", values | {"of": "a/b"})]
    causes = [attempt.cause for attempt in attempts_from_ticks(made, events)]
    assert [(c and c.code, c and c.message, c and c.node) for c in causes] == [("slipped", "gap 3 mm", "a/b")] * 2


@pytest.mark.parametrize("values", [{}, {"code": 3, "message": "x"}, {"code": "slipped", "message": 3}])
def test_an_event_that_names_no_cause_names_none(values: dict[str, object]) -> None:
    [attempt] = attempts_from_ticks([NodeExecution("a", 0.0, 1.0, "FAILURE")], [Event(1.0, "failed", "a", values)])
    assert attempt.cause is None


def test_the_ticks_and_events_of_a_real_run_tell_the_attempts_of_its_result() -> None:
    record = read_record(Path(__file__).parents[2] / "support" / "record")
    assert record.result is not None
    assert attempts(replace(record, result=None)) == [*record.result.attempts]
    assert {attempt.cause is not None for attempt in record.result.attempts if attempt.status == "FAILURE"} == {True}


def test_explain_and_the_tree_s_picture_count_alike(tmp_path: Path) -> None:
    record = read_record(write_record(tmp_path / "run"))
    stats = run_stats((tick.t, tick.path, tick.status) for tick in record.ticks)
    counted = Counter[str]()
    for attempt in attempts(record):
        counted[attempt.path] += attempt.times
    assert counted == {path: stats[path].visits for path in counted}
