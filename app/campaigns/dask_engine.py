"""An engine: the workers of a Dask scheduler, on this machine or a cluster. Needs the extra `cluster`."""

import logging
import pickle
import re
import subprocess
import sys
import threading
from collections.abc import Generator, Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from distributed import Client, as_completed
from distributed.scheduler import KilledWorker

from regrasp.app.campaigns.campaign import Job
from regrasp.app.campaigns.remote import Delivery, Order
from regrasp.app.files.findings import Finding, Findings
from regrasp.app.run.processes import Done
from regrasp.interfaces.quote import quoted

CONNECT_SECONDS = 10.0  # until a scheduler counts as not there


@dataclass(frozen=True)
class Dask:
    """The workers of a scheduler. Each run is done in a process that the worker starts: its crash is a result.

    The workers need the same sources and packages. A record's files travel back with the result, so no common disk is
    needed. When a worker is lost, Dask gives its runs to others.
    """

    client: Client
    address: str

    @classmethod
    def connected(cls, address: str) -> Self:
        """To the scheduler at an address such as tcp://10.0.0.5:8786. Raises `Findings` if it is not there."""
        if not re.fullmatch(r"(\w+://)?[^\s/]+:\d+/?", address):  # such a client would end with a traceback
            message = f"{quoted(address)} is no address; write one such as tcp://127.0.0.1:8786"
            raise Findings([Finding("--scheduler", 0, message)])
        for name in [name for name in logging.root.manager.loggerDict if name.startswith("distributed")]:
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)  # a lost connection would be told by a traceback
        try:
            client = Client(address, timeout=CONNECT_SECONDS, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            why = str(error).splitlines()[0] if str(error) else type(error).__name__
            message = f"no scheduler answers at {address} ({why}); start one with `dask scheduler`, or name another"
            raise Findings([Finding("--scheduler", 0, message)]) from None
        if not client.scheduler_info()["workers"]:
            client.close()
            message = f"the scheduler at {address} has no workers; start some with `dask worker {address}`"
            raise Findings([Finding("--scheduler", 0, message)])
        return cls(client, address)

    def __call__(
        self, jobs: Iterable[tuple[Job, Path | None]], program: str, wall_limit: float
    ) -> Generator[Done[Any]]:
        """See `Engine`."""
        folders: dict[str, tuple[int, Path | None]] = {}
        futures = []
        for number, (job, folder) in enumerate(jobs):
            order = pickle.dumps(Order(program, job.task, folder is not None, wall_limit))
            kind = f"{program} {wall_limit}"
            future = self.client.submit(deliver, order, kind, key=f"{job.key}-{number}", pure=False, retries=0)
            folders[future.key] = number, folder
            futures.append(future)
        try:
            ended = as_completed(futures, loop=self.client.loop)
            del futures  # a future that is held keeps its result in the cluster's memory
            for future in ended:
                number, folder = folders[future.key]
                yield self._received(future, number, folder)
        finally:
            with suppress(Exception):  # the scheduler may be gone
                self.client.cancel(list(ended.futures) if "ended" in locals() else [])
            self.client.close(timeout=2)

    def _received(self, future: Any, number: int, folder: Path | None) -> Done[Any]:
        """A run's result, its record's files written to the folder."""
        if future.status == "finished":
            try:
                delivery: Delivery = pickle.loads(future.result(timeout=60))
            except Exception as error:
                raise self._lost(str(error)) from None
            if folder is not None and delivery.files:
                folder.mkdir(parents=True)
                for name, content in delivery.files.items():
                    (folder / name).parent.mkdir(exist_ok=True)
                    (folder / name).write_bytes(content)
            return delivery.done._replace(number=number)
        raised = future.exception() if future.status == "error" else None
        if isinstance(raised, KilledWorker):
            return Done(number, None, "each worker that had it was lost", 0.0)
        if raised is not None:
            message = f"its workers cannot do runs ({type(raised).__name__}: {raised}); give them what this machine has"
            raise Findings([Finding("--scheduler", 0, message)])
        raise self._lost(f"its task was {future.status}")

    def _lost(self, why: str) -> Findings:
        message = f"the scheduler at {self.address} is lost ({why}); what is done is kept: give the same command again"
        return Findings([Finding("--scheduler", 0, message)])


# Not python -m: pickles would name classes of __main__, which the Dask worker does not have.
_PROGRAM = "from regrasp.app.campaigns.remote import main; main()"
_idle: list[tuple[str, "subprocess.Popen[bytes]"]] = []  # of this Dask worker: programs that do runs, by kind
_idle_lock = threading.Lock()


def deliver(order: bytes, kind: str) -> bytes:
    """In a Dask worker: have a program do a pickled `Order`, and return its pickled `Delivery`.

    `kind` tells apart what one program cannot do after the other: other sources, another wall limit.
    """
    program = _taken(kind)
    if program is None:
        program = subprocess.Popen([sys.executable, "-c", _PROGRAM], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert program.stdin is not None
    assert program.stdout is not None
    try:
        program.stdin.write(order)
        program.stdin.flush()
        delivery: Delivery = pickle.load(program.stdout)
    except (EOFError, OSError, pickle.UnpicklingError):
        program.kill()
        return pickle.dumps(Delivery(Done(0, None, "the process died", 0.0, killed=True), {}))
    with _idle_lock:
        _idle.append((kind, program))
    return pickle.dumps(delivery)


def _taken(kind: str) -> "subprocess.Popen[bytes] | None":
    """An idle program of that kind that lives; those of other kinds end, for their campaign is over."""
    with _idle_lock:
        for other, program in _idle:
            if other != kind:
                program.terminate()
        _idle[:] = [(other, program) for other, program in _idle if other == kind and program.poll() is None]
        return _idle.pop()[1] if _idle else None
