"""Does the runs of a Dask worker: a program of its own, which the worker starts and talks to.

Tasks come on stdin and go back on stdout, each a pickle. It is no child of `multiprocessing`, which a Dask worker may
not have; it does each run in one, whose native crash ends neither the worker nor this program.
"""

import pickle
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import closing
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from regrasp.app.campaigns.campaign import checked
from regrasp.app.run.processes import Done, run_each

Files = dict[str, bytes]


class Order(NamedTuple):
    """A task to do. `leaves_record`: it gets a folder, whose files go back with the result."""

    program: str
    task: Callable[[Path | None], Any]
    leaves_record: bool
    wall_limit: float


class Delivery(NamedTuple):
    """How a task ended, and the files of its record."""

    done: Done[Any]
    files: Files


def main() -> None:
    """Do one task after the other until stdin ends; a process that has done one does the next."""
    given, back = sys.stdin.buffer, sys.stdout.buffer
    sys.stdout = sys.stderr  # what a run prints is no result
    with tempfile.TemporaryDirectory(prefix="regrasp-") as place:
        orders, folder = _orders(given), Path(place, "record")
        first = next(orders, None)
        if first is None:
            return
        tasks = (
            partial(checked, order.program, order.task, folder if order.leaves_record else None)
            for order in chain([first], orders)
        )
        with closing(run_each(tasks, 1, first.wall_limit)) as dones:
            for done in dones:
                pickle.dump(Delivery(done, taken(folder)), back)
                back.flush()


def _orders(stream: BinaryIO) -> Iterator[Order]:
    while True:
        try:
            yield pickle.load(stream)
        except EOFError:
            return


def taken(folder: Path) -> Files:
    """The files of a folder by their paths in it; it is removed."""
    files = {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    shutil.rmtree(folder, ignore_errors=True)
    return files
