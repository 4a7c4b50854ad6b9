from collections.abc import Callable
from functools import partial

import pytest

from regrasp.app.tasks.cable.studies.pose.tasks import run_tasks


def twice(value: int) -> list[int]:
    return [value, value]


def broken() -> list[int]:
    raise ValueError("no such thing")


def test_what_the_tasks_gave_comes_in_their_order(capsys: pytest.CaptureFixture[str]) -> None:
    kept: list[list[int]] = []
    found, code = run_tasks({"one": partial(twice, 1), "two": partial(twice, 2)}, 2, kept.append)
    assert (found, code) == ([1, 1, 2, 2], 0)
    assert [len(some) for some in kept] == [2, 4]
    assert {line.split("] ")[1] for line in capsys.readouterr().err.splitlines()} == {"one: 1, 1", "two: 2, 2"}


def test_one_that_breaks_off_leaves_the_others(capsys: pytest.CaptureFixture[str]) -> None:
    tasks: dict[str, Callable[[], list[int]]] = {"bad": broken, "good": partial(twice, 3)}
    found, code = run_tasks(tasks, 1, lambda _: None)
    assert (found, code) == ([3, 3], 1)
    assert "[1/2] bad: ValueError: no such thing" in capsys.readouterr().err


def test_ctrl_c_keeps_what_was_done(capsys: pytest.CaptureFixture[str]) -> None:
    def interrupted(some: list[int]) -> None:
        raise KeyboardInterrupt

    found, code = run_tasks({"one": partial(twice, 1), "two": partial(twice, 2)}, 1, interrupted)
    assert (found, code) == ([1, 1], 130)
    assert "1 of 2 scenes were done" in capsys.readouterr().err
