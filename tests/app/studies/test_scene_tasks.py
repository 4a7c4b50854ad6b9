from functools import partial
from pathlib import Path

import pytest
from pydantic import TypeAdapter

from regrasp.app.files.findings import Findings
from regrasp.app.studies.scene_tasks import SceneTask, run_tasks

NUMBERS = TypeAdapter(list[int])


def twice(value: int) -> list[int]:
    return [value, value]


def broken() -> list[int]:
    raise ValueError("no such thing")


def never() -> list[int]:
    raise AssertionError("it was done before")


ONE, TWO = SceneTask(partial(twice, 1), "1"), SceneTask(partial(twice, 2), "2")


def test_what_the_tasks_gave_comes_in_their_order(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_tasks({"one": ONE, "two": TWO}, 2, None, "numbers", NUMBERS) == ([1, 1, 2, 2], 0)
    assert {line.split("] ")[1] for line in capsys.readouterr().err.splitlines()} == {"one: 1, 1", "two: 2, 2"}


def test_one_that_breaks_off_leaves_the_others_and_is_done_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = SceneTask(broken, "3")
    assert run_tasks({"bad": bad, "one": ONE}, 1, tmp_path / "study", "numbers", NUMBERS) == ([1, 1], 1)
    assert "[1/2] bad: ValueError: no such thing" in capsys.readouterr().err
    again = {"bad": SceneTask(partial(twice, 3), "3"), "one": SceneTask(never, "1")}
    assert run_tasks(again, 1, tmp_path / "study", "numbers", NUMBERS) == ([3, 3, 1, 1], 0)


def test_a_folder_with_other_things_is_refused(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").touch()
    with pytest.raises(Findings, match=r"holds other things \(mine.txt\)"):
        run_tasks({"one": ONE}, 1, tmp_path, "numbers", NUMBERS)
