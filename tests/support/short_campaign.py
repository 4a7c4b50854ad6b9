"""A campaign of short tasks, as a program of its own that tests kill: `short_campaign.py FOLDER COUNT [PIDS]`."""

import os
import sys
import time
from functools import partial
from pathlib import Path
from typing import Any

from regrasp.app.campaigns.campaign import Ended, Job, Local, do_all
from regrasp.app.campaigns.progress import Progress
from regrasp.app.campaigns.store import Store
from regrasp.app.run.processes import Done

KIND = "short tasks"


def work(number: int, pids: Path, folder: Path | None) -> int:
    """Takes a tenth of a second, and leaves a record of two files."""
    (pids / str(os.getpid())).touch()
    assert folder is not None
    folder.mkdir(parents=True)
    (folder / "begun").write_text(str(number))
    time.sleep(0.1)
    (folder / "ended").write_text(str(number))
    return number


def ended(number: int, done: Done[int], folder: Path | None) -> Ended:
    """The row of a task."""
    return Ended({"value": done.value, "error": done.error}, str(done.value), done.value is not None, keep=True)


def main(folder: Path, count: int, pids: Path) -> None:
    """Do the tasks that are left."""
    pids.mkdir(exist_ok=True)
    (pids / str(os.getpid())).touch()
    jobs = [Job(f"task {n}", f"key {n}", partial(work, n, pids), f"task-{n}") for n in range(count)]
    with Store.create(folder, KIND) as store:
        interrupted = do_all(jobs, store, Local(2), ended, Progress(quiet=True))
    sys.exit(130 if interrupted else 0)


if __name__ == "__main__":
    given: Any = sys.argv[1:]
    main(Path(given[0]), int(given[1]), Path(given[2]))
