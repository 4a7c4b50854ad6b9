import pytest

from app.record_reader import Event
from app.tried import told_by_ticks
from trees import Execution


def test_a_cause_is_told_by_the_event_of_the_failure() -> None:
    made = [Execution("a/b", 0.0, 1.0, "FAILURE"), Execution("a/stop", 1.0, 1.3, "FAILURE")]
    values = {"code": "slipped", "message": "gap 3 mm"}
    events = [Event(1.0, "failed", "a/b", values), Event(1.3, "failed", "a/stop", values | {"of": "a/b"})]
    causes = [attempt.cause for attempt in told_by_ticks(made, events)]
    assert [(c and c.code, c and c.message, c and c.node) for c in causes] == [("slipped", "gap 3 mm", "a/b")] * 2


@pytest.mark.parametrize("values", [{}, {"code": "no such", "message": "x"}, {"code": "slipped", "message": 3}])
def test_an_event_that_names_no_cause_names_none(values: dict[str, object]) -> None:
    [attempt] = told_by_ticks([Execution("a", 0.0, 1.0, "FAILURE")], [Event(1.0, "failed", "a", values)])
    assert attempt.cause is None
