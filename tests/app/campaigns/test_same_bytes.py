"""The same bytes wherever a run is done: a new process, one that has done others, the workers of a Dask scheduler."""

import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from regrasp.app.campaigns.campaign import Effort, Engine, Local, do_all
from regrasp.app.campaigns.dask_engine import Dask
from regrasp.app.campaigns.episodes import KIND, Stored, jobs_of
from regrasp.app.campaigns.plan import planned
from regrasp.app.campaigns.progress import Progress
from regrasp.app.campaigns.store import Store
from regrasp.app.files.findings import Findings
from regrasp.app.run.batch import Settings
from regrasp.app.run.processes import Renewal

SHORT = ("limits.sim_seconds=4",)  # start-up, and the way to the plug
WALL = ("wall_seconds", "real_time_factor", "wall_by_part", "longest_tick")


def done(folder: Path, engine: Engine, seeds: range) -> dict[str, Any]:
    """The records' files of a campaign, by run and name; of the results without wall times."""
    runs = planned("short_obstacle", SHORT, seeds)
    with Store.create(folder, KIND) as store:
        assert not do_all(jobs_of(runs, Settings()), store, engine, Stored(runs, "all"), Progress(quiet=True), Effort())
        rows = [*store.rows(1)]
    assert len(rows) == len(runs)
    return {f"{row.title} {name}": _content(folder / row.record / name) for row in rows for name in FILES}


FILES = ("ticks.jsonl", "events.jsonl", "result.json")


def _content(path: Path) -> Any:
    if path.name != "result.json":
        return path.read_bytes()
    return {key: value for key, value in json.loads(path.read_text()).items() if key not in WALL}


@pytest.fixture(scope="module")
def fresh(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Each run in a process of its own."""
    return done(tmp_path_factory.mktemp("fresh") / "c", Local(2, Renewal(tasks=1)), range(2))


def test_a_process_that_has_done_other_runs(tmp_path: Path, fresh: dict[str, Any]) -> None:
    assert len({str(content) for content in fresh.values()}) > 8  # the runs differ
    assert done(tmp_path / "c", Local(1), range(2)) == fresh


class Cluster(NamedTuple):
    """A scheduler's address, its process and those of its two workers."""

    address: str
    scheduler: "subprocess.Popen[str]"
    workers: list["subprocess.Popen[bytes]"]


@pytest.fixture
def cluster() -> Iterator[Cluster]:
    dask = [sys.executable, "-m", "distributed.cli.dask_scheduler"]
    place = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    with subprocess.Popen([*dask, *place], stderr=subprocess.PIPE, text=True) as serving:
        assert serving.stderr is not None
        address = next(line.split()[-1] for line in serving.stderr if "Scheduler at:" in line)
        command = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard"]
        workers = [subprocess.Popen([*command, "--no-nanny"], stderr=subprocess.DEVNULL) for _ in range(2)]
        yield Cluster(address, serving, workers)
        serving.kill()
        for process in workers:
            process.kill()
            process.wait()


@pytest.mark.slow
def test_the_workers_of_a_scheduler_one_of_which_is_killed(
    tmp_path: Path, fresh: dict[str, Any], cluster: Cluster
) -> None:
    engine = _connected(cluster.address)
    progress = _KillsAfterTheFirst(cluster.workers[0])
    runs = planned("short_obstacle", SHORT, range(2))
    with Store.create(tmp_path / "c", KIND) as store:
        do_all(jobs_of(runs, Settings()), store, engine, Stored(runs, "all"), progress)
        rows = [*store.rows(1)]
    assert cluster.workers[0].wait() == -signal.SIGKILL
    assert len(rows) == len({row.key for row in rows}) == 4
    found = {f"{row.title} {name}": _content(tmp_path / "c" / row.record / name) for row in rows for name in FILES}
    assert found == fresh


class _KillsAfterTheFirst(Progress):
    def __init__(self, process: "subprocess.Popen[Any]") -> None:
        super().__init__(quiet=True)
        self._process = process

    def ended(self, title: str, words: str, succeeded: bool) -> None:
        super().ended(title, words, succeeded)
        self._process.kill()


def test_a_scheduler_that_dies(tmp_path: Path, cluster: Cluster) -> None:
    engine = _connected(cluster.address)
    runs = planned("short_obstacle", SHORT, range(3))
    progress = _KillsAfterTheFirst(cluster.scheduler)
    with Store.create(tmp_path / "c", KIND) as store, pytest.raises(Findings, match="is lost"):
        do_all(jobs_of(runs, Settings()), store, engine, Stored(runs, "none"), progress)
    with Store.read(tmp_path / "c") as store:
        assert [version.runs for version in store.versions()] == [1]


def _connected(address: str, workers: int = 2) -> Dask:
    until = time.monotonic() + 60
    while True:
        try:
            engine = Dask.connected(address)
            if len(engine.client.scheduler_info()["workers"]) == workers:
                return engine
            engine.client.close()
        except Findings:
            pass
        assert time.monotonic() < until
        time.sleep(0.2)


def test_no_scheduler_and_no_workers() -> None:
    with pytest.raises(Findings, match=r"no scheduler answers at tcp://127\.0\.0\.1:1"):
        Dask.connected("tcp://127.0.0.1:1")
    for address in ("nonsense://", "foo", "tcp://foo", ""):
        with pytest.raises(Findings, match=f"'{address}' is no address; write one such as tcp://127.0.0.1:8786"):
            Dask.connected(address)
    with pytest.raises(Findings, match="no scheduler answers at nonsense://a:1"):
        Dask.connected("nonsense://a:1")
