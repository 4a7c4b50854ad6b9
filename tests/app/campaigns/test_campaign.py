"""Campaigns: every run once, whatever dies meanwhile."""

import contextlib
import errno
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from short_campaign import KIND

from regrasp.app.campaigns.campaign import Effort, Ended, Job, Local, checked, do_all, version_of
from regrasp.app.campaigns.progress import Progress
from regrasp.app.campaigns.store import Store
from regrasp.app.files.findings import Findings
from regrasp.app.run.processes import Done, Renewal, run_each

EFFORT = Effort()
PROGRAM = Path(__file__).parents[2] / "support/short_campaign.py"


def told(number: int, done: Done[Any], folder: Path | None) -> Ended:
    return Ended({"value": done.value, "error": done.error}, "", done.value is not None, keep=done.value != 2)


def campaign(folder: Path | None, tasks: dict[str, Callable[[Path | None], Any]], effort: Effort = EFFORT) -> Any:
    """Do the tasks; their values and errors by their keys."""
    jobs = [Job(f"task {key}", key, task, f"record-{key}") for key, task in tasks.items()]
    with Store.create(folder, KIND) as store:
        do_all(jobs, store, Local(2), told, Progress(quiet=True), effort)
        return {row.key: (row.value["value"], row.value["error"], row.record) for row in store.rows(version_of(store))}


def give(value: int, folder: Path | None) -> int:
    if folder is not None:
        folder.mkdir(parents=True)
        (folder / "told").write_text(str(value))
    return value


def never(folder: Path | None) -> int:
    raise AssertionError("it was done before")


def abort(folder: Path | None) -> int:
    os.abort()


def killed_once(mark: Path, folder: Path | None) -> int:
    if not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return 7


def killed(mark: Path, folder: Path | None) -> int:
    with mark.open("a") as file:
        file.write("x")
    os.kill(os.getpid(), signal.SIGKILL)
    return 0


def sleep(folder: Path | None) -> int:
    time.sleep(60)
    return 0


def test_what_is_done_is_not_done_again(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    first = campaign(tmp_path / "c", {"a": partial(give, 1), "b": partial(give, 2)})
    assert first == {"a": (1, "", "runs/record-a"), "b": (2, "", "")}
    second = campaign(tmp_path / "c", {"a": never, "b": never, "c": partial(give, 3)})
    assert {key: value for key, (value, *_) in second.items()} == {"a": 1, "b": 2, "c": 3}
    assert "2 of 3 are done already" in capfd.readouterr().err
    assert sorted(path.name for path in (tmp_path / "c/runs").iterdir()) == ["record-a", "record-c"]
    assert sorted(path.name for path in (tmp_path / "c").iterdir()) == ["campaign.db", "campaign.lock", "runs"]


def test_without_a_folder_nothing_is_kept() -> None:
    assert campaign(None, {"a": partial(give, 1)}) == {"a": (1, "", "")}


def test_a_native_crash_is_one_failed_run(tmp_path: Path) -> None:
    found = campaign(tmp_path / "c", {"a": abort, "b": partial(give, 1), "c": partial(give, 3)})
    assert found["a"][:2] == (None, f"the process died with exit code -{signal.SIGABRT.value} (SIGABRT)")
    assert (found["b"][0], found["c"][0]) == (1, 3)


def test_a_run_whose_process_is_killed_is_done_again(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    found = campaign(
        tmp_path / "c",
        {"a": partial(killed_once, tmp_path / "a"), "b": partial(killed, tmp_path / "b")},
        Effort(tries=3),
    )
    assert found["a"][:2] == (7, "")
    assert found["b"][:2] == (None, "the process was killed from outside (SIGKILL), as when memory runs out")
    assert (tmp_path / "b").read_text() == "xxx"
    assert "task a: its process was killed; it is done again" in capfd.readouterr().err


def test_the_wall_limit_is_one_run_s(tmp_path: Path) -> None:
    found = campaign(tmp_path / "c", {"a": sleep, "b": partial(give, 1)}, Effort(wall_limit=6.0))
    assert found["a"][:2] == (None, "stopped after 6 s of wall time")
    assert found["b"][0] == 1


def test_what_a_killed_campaign_left_is_cleared_away(tmp_path: Path) -> None:
    campaign(tmp_path / "c", {"a": partial(give, 1)})
    for name in ("runs/record-b", ".unfinished/0.0"):
        (tmp_path / "c" / name).mkdir(parents=True)
    found = campaign(tmp_path / "c", {"a": never, "b": partial(give, 4)})
    assert found["b"][2] == "runs/record-b"
    assert (tmp_path / "c/runs/record-b/told").read_text() == "4"
    assert not (tmp_path / "c/.unfinished").exists()


def test_a_full_disk_ends_it_and_what_is_done_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    campaign(tmp_path / "c", {"a": partial(give, 1)})

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patched:
        patched.setattr("pathlib.Path.replace", full)
        with pytest.raises(Findings, match=r"c: the disk is full: make room, then give the same command again"):
            campaign(tmp_path / "c", {"a": never, "b": partial(give, 4)})
    assert campaign(tmp_path / "c", {"a": never, "b": partial(give, 4)})["b"][0] == 4


def test_sources_that_change_meanwhile_end_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("regrasp.app.campaigns.campaign.program_digest", lambda: "other")
    with pytest.raises(Findings, match="sources or packages changed"):
        campaign(tmp_path / "c", {"a": partial(give, 1)})
    with Store.read(tmp_path / "c") as store:
        assert [version.runs for version in store.versions()] == [0]


def test_other_sources_are_done_beside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    campaign(tmp_path / "c", {"a": partial(give, 1)})
    with Store.create(tmp_path / "c", KIND) as store:
        store.version_id("older", {})
        store._connection.execute("update row set version = 2")
        store._connection.commit()
    assert campaign(tmp_path / "c", {"a": partial(give, 3)}) == {"a": (3, "", f"runs/record-a-{'a'[:8]}-1")}


def pid() -> int:
    return os.getpid()


def grow() -> int:
    global _held
    _held = bytearray(os.urandom(30 << 20))
    return os.getpid()


_held: bytearray


def test_a_process_does_several_tasks_and_is_renewed() -> None:
    pids = [done.value for done in run_each([pid] * 7, 1, renewal=Renewal(tasks=3))]
    assert [pids.index(value) for value in pids] == [0, 0, 0, 3, 3, 3, 6]
    pids = [done.value for done in run_each([pid, grow, pid, pid], 1, renewal=Renewal(growth_mb=20.0))]
    assert [pids.index(value) for value in pids] == [0, 0, 2, 2]


def test_tasks_are_taken_when_a_process_is_free() -> None:
    taken = []

    def tasks() -> Any:
        for number in range(4):
            taken.append(number)
            yield pid

    for count, _ in enumerate(run_each(tasks(), 1), 1):
        assert len(taken) == count


def test_a_task_of_other_sources_is_refused() -> None:
    with pytest.raises(Exception, match="not those with which the campaign began"):
        checked("other", never, None)


def test_killed_at_random_moments_every_run_is_there_once(tmp_path: Path) -> None:
    """Kills of the campaign or of one of its processes, as many as KILLS says; then one that may end."""
    kills = int(os.environ.get("KILLS", "3"))
    draw, count, pids = random.Random(5), 7 * kills + 10, tmp_path / "pids"
    command = [sys.executable, str(PROGRAM), str(tmp_path / "c"), str(count), str(pids)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    for kill in range(kills):
        for path in pids.glob("*"):
            path.unlink()
        with subprocess.Popen(command, env=environment, start_new_session=True) as process:
            _wait_for_pids(pids, 3 if kill % 2 else 1, process)
            time.sleep(draw.uniform(0.0, 0.6))
            alive = [int(path.name) for path in pids.iterdir()]
            victim = process.pid if kill % 2 == 0 else draw.choice(alive)
            with contextlib.suppress(ProcessLookupError):
                os.kill(victim, signal.SIGKILL)
            time.sleep(draw.uniform(0.0, 0.3))
            process.kill()
    assert subprocess.run(command, env=environment).returncode == 0
    with Store.read(tmp_path / "c") as store:
        rows = [*store.rows(1)]
        assert sorted(row.value["value"] for row in rows) == [*range(count)]
        for row in rows:
            folder = tmp_path / "c" / row.record
            assert (folder / "begun").read_text() == (folder / "ended").read_text() == str(row.value["value"])
        assert {f"runs/{path.name}" for path in (tmp_path / "c/runs").iterdir()} == {row.record for row in rows}


def _wait_for_pids(folder: Path, count: int, process: Any) -> None:
    """Until so many processes have begun, or the campaign has ended."""
    until = time.monotonic() + 30
    while len([*folder.glob("*")]) < count and process.poll() is None and time.monotonic() < until:
        time.sleep(0.01)
