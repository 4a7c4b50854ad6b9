"""Runs that are stopped from outside: by signals, at the wall limit, and by a kill. What is left of them."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from regrasp.app.interrupts import StopRequests
from regrasp.app.records.explain import explanation
from regrasp.app.records.reader import read_record
from regrasp.app.records.record import AT_WORK, Record, leaf_at_work
from regrasp.app.run.batch import Run, result_of
from regrasp.app.run.processes import Done, run_each
from regrasp.app.scenario.load import load_scenario

ROOT = Path(__file__).parents[2]
PATIENCE = 120.0  # s

Started = Callable[..., "subprocess.Popen[str]"]


def write(folder: Path, leaf: str) -> None:
    tree = f'<root main_tree_to_execute="M"><BehaviorTree ID="M"><{leaf} name="hang"/></BehaviorTree></root>'
    (folder / "tree.xml").write_text(tree)
    (folder / "mine.yaml").write_text("description: hangs\ncell: thesis\ntree: tree.xml\ngravity: zero\n")


@pytest.fixture
def start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Started]:
    """Starts `regrasp run mine.yaml --out run`, whose tree is a single leaf of `hanging.py`."""
    monkeypatch.chdir(tmp_path)
    running = []

    def started(leaf: str, *options: str) -> "subprocess.Popen[str]":
        write(tmp_path, leaf)
        command = [sys.executable, str(ROOT / "tests/support/hanging.py"), "run", "mine.yaml", "--out", "run", *options]
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        pipe = subprocess.PIPE
        process = subprocess.Popen(
            command, stdout=pipe, stderr=pipe, text=True, env=environment, start_new_session=True
        )
        running.append(process)
        return process

    yield started
    for process in running:
        process.kill()
        process.communicate()


def until(ready: Callable[[], Any], process: "subprocess.Popen[str]") -> None:
    end = time.monotonic() + PATIENCE
    while not ready():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end
        time.sleep(0.05)


def at_work() -> bool:
    """Whether the leaf's tick goes on."""
    return leaf_at_work(Path("run")) is not None


def goes_on() -> bool:
    ticks = Path("run/ticks.jsonl")
    return ticks.exists() and ticks.stat().st_size > 0


def result() -> dict[str, Any]:
    read: dict[str, Any] = json.loads(Path("run/result.json").read_text())
    assert not [path.name for path in Path("run").iterdir() if path.name.endswith(".part") or path.name == AT_WORK]
    return read


@pytest.mark.parametrize(
    "number", [signal.SIGINT, *(pytest.param(n, marks=pytest.mark.slow) for n in (signal.SIGTERM, signal.SIGHUP))]
)
def test_six_signals_at_once_leave_a_whole_record(start: Started, number: int) -> None:
    process = start("Goes")
    until(goes_on, process)
    for _ in range(6):
        process.send_signal(number)
        time.sleep(0.02)
    process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert (result()["outcome"], result()["cause"]["node"]) == ("interrupted", "hang")


@pytest.mark.slow
def test_a_run_ends_even_if_a_library_swallows_the_interrupt(start: Started) -> None:
    process = start("Swallows")
    until(goes_on, process)
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert result()["outcome"] == "interrupted"


def test_a_second_ctrl_c_ends_a_leaf_that_hangs_in_its_first_tick_and_names_it(start: Started) -> None:
    process = start("Hangs")
    until(at_work, process)
    process.send_signal(signal.SIGINT)
    time.sleep(StopRequests().burst + 0.2)
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    read = result()
    assert (read["outcome"], read["cause"]["node"]) == ("interrupted", "hang")
    assert "in the middle of a tick" in out
    assert [(a["path"], a["cause"]["code"]) for a in read["attempts"]] == [("hang", "interrupted")]
    assert [link["why"] for link in read["chain"]] == ["was still running"]


@pytest.mark.slow
def test_a_run_that_is_killed_in_a_first_tick_names_the_leaf(start: Started) -> None:
    process = start("Hangs")
    until(at_work, process)
    assert "hang: its tick at 0.00 s has not ended" in explanation(read_record(Path("run")), 80)
    process.kill()
    process.communicate()
    assert "hang: its tick at 0.00 s has not ended" in explanation(read_record(Path("run")), 80)


@pytest.mark.parametrize("leaf", [pytest.param("Hangs", marks=pytest.mark.slow), "HangsDeaf"])
def test_a_run_that_hangs_is_stopped_at_the_wall_limit(start: Started, leaf: str) -> None:
    process = start(leaf, "--wall-limit", "15")
    out, told = process.communicate(timeout=PATIENCE)
    assert (process.returncode, "Traceback" in told) == (1, False)
    assert "wall_limit: stopped" in out + told
    if not Path("run/events.jsonl").exists():  # a machine so slow that it still imported
        return
    read = result()
    assert (read["outcome"], read["cause"]["code"]) == ("wall_limit", "wall_limit")
    if Path("run/events.jsonl").read_text():  # else the world was still being built
        assert read["cause"]["node"] == "hang"


@pytest.mark.slow
def test_nohup_is_respected(start: Started) -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    process = start("Goes")
    signal.signal(signal.SIGHUP, before)
    until(goes_on, process)
    process.send_signal(signal.SIGHUP)
    time.sleep(0.5)
    assert process.poll() is None


@pytest.mark.parametrize(
    "options", [("--wall-limit", "100"), pytest.param(("--all", "--jobs", "1"), marks=pytest.mark.slow)]
)
def test_a_run_whose_parent_is_killed_ends_with_its_record(start: Started, options: tuple[str, ...]) -> None:
    process = start("Goes", *options)
    folder = Path("run") if "--all" not in options else Path("run/default")
    until(lambda: (folder / "ticks.jsonl").exists() and (folder / "ticks.jsonl").stat().st_size > 0, process)
    process.kill()
    _, told = process.communicate(timeout=PATIENCE)  # the child has its streams, too: it has ended
    assert "Traceback" not in told
    assert json.loads((folder / "result.json").read_text())["outcome"] == "interrupted"


def test_a_run_stopped_before_it_began_has_no_record_and_says_so(start: Started, tmp_path: Path) -> None:
    write(tmp_path, "Goes")
    command = [sys.executable, str(ROOT / "tests/support/hanging.py"), "run", "mine.yaml", "--wall-limit", "1"]
    ran = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": str(ROOT)})
    assert ran.returncode == 1
    if "before the run began" in ran.stderr:  # a very quick machine may come further in a second
        assert ran.stderr == "wall_limit: stopped after 1 s of wall time, before the run began; there is no record\n"
        assert not (tmp_path / "runs").exists()


def hang() -> None:
    while True:
        time.sleep(0.01)


def hang_deaf() -> None:
    signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
    hang()


def answer() -> int:
    return 7


def test_a_task_that_takes_too_long_is_stopped_and_the_others_go_on() -> None:
    with closing(run_each([hang, answer, hang_deaf], 3, wall_limit=20.0, grace=0.5)) as ended:
        done = sorted(ended)
    assert [(one.value, one.timed_out) for one in done] == [(None, True), (7, False), (None, True)]
    assert {one.error for one in done} == {"stopped after 20 s of wall time", ""}


def test_a_result_is_written_to_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write = os.fsync

    def interrupted(number: int) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.01)
        write(number)

    monkeypatch.setattr("os.fsync", interrupted)
    with pytest.raises(KeyboardInterrupt), Record(tmp_path / "run", "s", 1):
        pass
    assert json.loads((tmp_path / "run/result.json").read_text())["scenario"] == "s"
    kept = ["events.jsonl", "result.json", "signals.f32", "ticks.jsonl"]
    assert sorted(path.name for path in (tmp_path / "run").iterdir()) == kept


def test_a_process_that_died_gets_its_result_from_the_parent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record = Record(tmp_path / "run", "no_obstacle", 1)
    record.at_work(5.25, "recovery/mission/unplug")
    run = Run(load_scenario("no_obstacle"), 1, tmp_path / "run")
    made = result_of(run, Done(0, None, "the process died with exit code -11", 0.0))
    assert made.cause is not None
    assert (made.outcome, made.cause.node, made.sim_seconds) == ("internal_error", "recovery/mission/unplug", 5.25)
    kept = read_record(tmp_path / "run")
    assert kept.result == made
    assert kept.at_work is None
