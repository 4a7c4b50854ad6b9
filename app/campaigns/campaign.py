"""Does jobs that the store does not hold yet, on some engine, and stores each as it ends."""

import errno
import shutil
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any, Protocol

from regrasp.app.campaigns.digest import digest_of, program
from regrasp.app.campaigns.progress import Progress
from regrasp.app.campaigns.store import NewRow, Store, Version
from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.run.processes import Done, Renewal, run_each

RECORDS, UNFINISHED = "runs", ".unfinished"  # folders of a campaign's folder


@dataclass(frozen=True)
class Job:
    """One thing to do. `task` is picklable; it gets the folder for its record, or None.

    `key` is a digest of all that decides what comes out, but for the program.
    """

    title: str
    key: str
    task: Callable[[Path | None], Any]
    record: str = ""  # name of its record's folder; '' if it leaves none
    family: tuple[str, str] = ("", "")  # see `Store.version_id`


@dataclass(frozen=True)
class Ended:
    """What came out of a job: plain values for the store, and a line for the progress.

    `value` None: it is not stored, and done again next time. `keep`: its record is kept.
    """

    value: dict[str, Any] | None
    words: str
    succeeded: bool = True
    keep: bool = False


class Engine(Protocol):
    """Where jobs are done."""

    def __call__(
        self, jobs: Iterable[tuple[Job, Path | None]], program: str, wall_limit: float
    ) -> Generator[Done[Any]]:
        """Do the jobs, each with the folder for its record; yield how each ended, by its number in `jobs`.

        The program that does them must have the digest `program`.
        """
        ...


@dataclass(frozen=True)
class Local:
    """An engine: processes of this machine."""

    jobs: int
    renewal: Renewal = Renewal()  # noqa: RUF009 - it does not change

    def __call__(
        self, jobs: Iterable[tuple[Job, Path | None]], program: str, wall_limit: float
    ) -> Generator[Done[Any]]:
        """See `Engine`."""
        tasks = (partial(checked, program, job.task, folder) for job, folder in jobs)
        yield from run_each(tasks, self.jobs, wall_limit, renewal=self.renewal)


class OtherProgram(Exception):  # noqa: N818 - it is no error of this program
    """The sources here are not those of the campaign."""


def checked(expected: str, task: Callable[[Path | None], Any], folder: Path | None) -> Any:
    """What a task returns. Raises `OtherProgram` if this process runs another program than the campaign's."""
    if program_digest() != expected:
        raise OtherProgram("its sources, or its packages, are not those with which the campaign began")
    return task(folder)


@cache
def program_digest() -> str:
    """A digest of `program()`."""
    return digest_of(program())


def is_of_this_program(version: Version) -> bool:
    """Whether the program that runs here did the runs of a version."""
    return digest_of(version.program) == program_digest()


def version_of(store: Store, jobs: Iterable[Job] = ()) -> int:
    """The number in the store of the program that runs here, with these jobs' families as they are now."""
    return store.version_id(program_digest(), program(), dict(job.family for job in jobs))


@dataclass(frozen=True)
class Effort:
    """What a campaign allows."""

    wall_limit: float = float("inf")  # s of wall time a run
    tries: int = 3  # of a run whose process was killed from outside, as by the kernel when memory ends


def do_all(
    jobs: Sequence[Job],
    store: Store,
    engine: Engine,
    ended: Callable[[int, Done[Any], Path | None], Ended],
    progress: Progress,
    effort: Effort = Effort(),
) -> bool:
    """Do those of the jobs that the store does not hold for this program. Returns whether Ctrl-C came.

    `ended` says what came out of a job, by its number and the folder of its record so far. A row is in the store, and
    its record in its place, before the next is looked at.

    Raises:
        Findings: the store cannot be written, the disk is full, or the sources changed meanwhile.
    """
    digest, version = program_digest(), version_of(store, jobs)
    had = store.keys(version, effort.wall_limit)
    left = [number for number, job in enumerate(jobs) if job.key not in had]
    _clear_away_leftovers(store)
    progress.begin(len(jobs), len(jobs) - len(left), sum(had.get(job.key, False) for job in jobs))
    try:
        for attempt in range(effort.tries):
            killed: list[int] = []
            given = [(jobs[n], _unfinished(store, jobs[n], f"{n}.{attempt}")) for n in left]
            with closing(engine(given, digest, effort.wall_limit)) as dones:
                for done in dones:
                    number, folder = left[done.number], given[done.number][1]
                    if done.killed and attempt + 1 < effort.tries:
                        killed.append(number)
                        progress.note(f"{jobs[number].title}: its process was killed; it is done again")
                        continue
                    _check_program(done)
                    outcome = ended(number, done._replace(number=number), folder)
                    look = _put_away(store, version, jobs[number], outcome, folder)
                    words = outcome.words if outcome.succeeded else f"{outcome.words}{look}"
                    progress.ended(jobs[number].title, words, outcome.succeeded)
            left = killed
            if not left:
                break
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EDQUOT):
            raise
        where = shown(store.folder) if store.folder else "the temporary folder"
        message = "the disk is full: make room, then give the same command again; what is done is kept"
        raise Findings([Finding(where, 0, message)]) from None
    except KeyboardInterrupt:
        progress.note(f"interrupted; {progress.done} of {len(jobs)} are done; the same command goes on there")
        return True
    finally:
        progress.close()
        if store.folder is not None:
            shutil.rmtree(store.folder / UNFINISHED, ignore_errors=True)
    return False


def _unfinished(store: Store, job: Job, name: str) -> Path | None:
    """Where a job's record is written; it is put into its place when the job has ended."""
    return store.folder / UNFINISHED / name if store.folder and job.record else None


def _put_away(store: Store, version: int, job: Job, outcome: Ended, folder: Path | None) -> str:
    """Put a record into its place, or away, then add the row. Returns how to look at it, as the end of a line."""
    record = ""
    if folder is not None and store.folder is not None and folder.is_dir():
        if outcome.keep and outcome.value is not None:
            (store.folder / RECORDS).mkdir(exist_ok=True)
            record = f"{RECORDS}/{job.record}"
            if (store.folder / record).exists():  # of another version, or with other values
                record = f"{record}-{job.key[:8]}-{version}"
            folder.replace(store.folder / record)
        else:
            shutil.rmtree(folder, ignore_errors=True)
    if outcome.value is None:
        return ""
    row = store.add(NewRow(version, job.key, job.title, outcome.value, record, job.family))
    if store.folder is None:
        return ""
    where = shown(store.folder)
    return f"; regrasp explain {where}/{record}" if record else f"; regrasp campaign rerun {where} {row}"


def _clear_away_leftovers(store: Store) -> None:
    """Remove what a campaign that was killed has left: records without a row."""
    if store.folder is None:
        return
    shutil.rmtree(store.folder / UNFINISHED, ignore_errors=True)
    known = store.records()
    for folder in (store.folder / RECORDS).glob("*"):
        if f"{RECORDS}/{folder.name}" not in known:
            shutil.rmtree(folder, ignore_errors=True)


def _check_program(done: Done[Any]) -> None:
    """Raise `Findings` when a run says nothing about the robot, for the sources have changed."""
    if done.error.startswith(OtherProgram.__name__):
        message = "sources or packages changed while it went on; give the same command again: it begins anew beside"
        raise Findings([Finding("campaign", 0, message)])
