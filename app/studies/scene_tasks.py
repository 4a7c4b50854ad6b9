"""Runs the scenes of a study as a campaign: in processes, each kept as it ends."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Generic, TypeVar

from pydantic import TypeAdapter

from regrasp.app.campaigns.campaign import Ended, Job, Local, do_all, version_of
from regrasp.app.campaigns.progress import Progress
from regrasp.app.campaigns.store import Store
from regrasp.app.records.result import plain
from regrasp.app.run.processes import Done

T = TypeVar("T")


@dataclass(frozen=True)
class SceneTask(Generic[T]):
    """What does a scene, and a digest of all that decides what comes out, but for the program."""

    run: Callable[[], Sequence[T]]
    key: str


def run_tasks(
    tasks: Mapping[str, SceneTask[T]], jobs: int, out: Path | None, kind: str, values: TypeAdapter[list[T]]
) -> tuple[list[T], int]:
    """Run tasks by their titles, `jobs` at a time: all their results in the tasks' order, and the exit code.

    With the folder `out` each is kept as it ends, and the same study again goes on where it stopped. `kind` says in
    the store what they are, and `values` writes and reads them. The code is 1 when a task raised an error or its
    process died, 130 after Ctrl-C, else 0.
    """
    broken = []

    def ended(number: int, done: Done[Any], folder: Path | None) -> Ended:
        if done.value is None:
            broken.append(number)
            return Ended(None, done.error, succeeded=False)
        words = ", ".join(map(str, done.value))
        return Ended({"values": plain(values.dump_python(list(done.value), mode="json"))}, words)

    with Store.create(out, kind) as store:
        scenes = [Job(title, task.key, partial(_alone, task.run)) for title, task in tasks.items()]
        interrupted = do_all(scenes, store, Local(jobs), ended, Progress(counted=False))
        stored = {row.key: row.value["values"] for row in store.rows(version_of(store, scenes))}
    found = [value for job in scenes if job.key in stored for value in values.validate_python(stored[job.key])]
    return found, 130 if interrupted else int(bool(broken))


def _alone(run: Callable[[], Sequence[T]], _folder: Path | None) -> Sequence[T]:
    """A scene leaves no record."""
    return run()
