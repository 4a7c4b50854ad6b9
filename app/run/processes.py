"""Tasks in processes, one process per task: py_trees' blackboard and PyBullet's globals exist once per process."""

import contextlib
import math
import os
import signal
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection, wait
from typing import Any, Generic, NamedTuple, TypeVar

from regrasp.app.interrupts import WALL_LIMIT_SIGNAL, listen_to_parent

T = TypeVar("T")


class Done(NamedTuple, Generic[T]):
    """How one task ended: its number, what it returned (None if it died), the error in words, peak memory in MB.

    `timed_out`: it was stopped at the wall limit and returned nothing.
    """

    number: int
    value: T | None
    error: str
    peak_memory_mb: float
    timed_out: bool = False


@dataclass
class _Child:
    number: int
    process: Any
    deadline: float  # on the monotonic clock
    signalled: bool = False  # that its time is over


def run_each(
    tasks: Sequence[Callable[[], T]], jobs: int, wall_limit: float = math.inf, grace: float = 10.0
) -> Generator[Done[T]]:
    """Run picklable tasks, at most `jobs` at a time, and yield each as it ends, in any order.

    A task that raises or crashes yields its error; the others go on. A task that takes longer than `wall_limit`
    seconds of wall time gets a `WallLimit`; if it has not ended `grace` seconds later, it is killed. When the caller
    closes the iterator, or at Ctrl-C, the running tasks get a KeyboardInterrupt and have `grace` seconds to end.
    """
    context = get_context("spawn")
    waiting = list(enumerate(tasks))
    running: dict[Any, _Child] = {}
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                number, task = waiting.pop(0)
                reader, writer = context.Pipe(duplex=False)
                process = context.Process(target=_child, args=(writer, task), daemon=True)
                with _signals_blocked():
                    process.start()
                writer.close()  # the child has the only one now: its death shows as an end of file
                running[reader] = _Child(number, process, time.monotonic() + wall_limit)
            for ready in wait(list(running), _seconds_to_deadline(running.values())):
                child = running[ready]
                yield _received(child, ready, wall_limit)
                del running[ready]
            _enforce_deadlines(running.values(), grace)
    finally:
        _stop([child.process for child in running.values()], grace)


def _seconds_to_deadline(children: Iterable[_Child]) -> float | None:
    """Wall-clock seconds until the first child's deadline; None if none has one."""
    first = min(child.deadline for child in children)
    return None if first == math.inf else max(0.0, first - time.monotonic())


def _enforce_deadlines(children: Iterable[_Child], grace: float) -> None:
    """Signal the children whose time is over; kill those that were signalled `grace` seconds ago and go on."""
    now = time.monotonic()
    for child in children:
        if now >= child.deadline:
            if child.signalled:
                child.process.kill()
            else:
                os.kill(child.process.pid, WALL_LIMIT_SIGNAL)
            child.signalled, child.deadline = True, math.inf if child.signalled else now + grace


@contextlib.contextmanager
def _signals_blocked() -> Iterator[None]:
    """Children started in this context do not get SIGINT and SIGHUP; this process gets them when it ends.

    A terminal sends both to all its processes. A child that ignored them by itself would do so too late: they could
    come while it still imports.
    """
    resource_tracker.ensure_running()  # its start would end the block
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGHUP})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _received(child: _Child, reader: Any, wall_limit: float) -> Done[Any]:
    try:
        value, error, peak = reader.recv()
    except EOFError:
        value, error, peak = None, "", 0.0
    child.process.join()
    reader.close()
    timed_out = value is None and child.signalled
    if timed_out:
        error = f"stopped after {wall_limit:g} s of wall time"
    elif value is None and not error:
        error = f"the process died with exit code {child.process.exitcode}"
    return Done(child.number, value, error, peak, timed_out)


def _stop(processes: Sequence[Any], grace: float) -> None:
    for process in processes:
        process.terminate()
    for process in processes:
        process.join(grace)
        if process.is_alive():
            process.kill()
            process.join()


def _child(writer: "Connection[Any, Any]", task: Callable[[], Any]) -> None:
    listen_to_parent()
    with contextlib.suppress(KeyboardInterrupt, BrokenPipeError):  # the parent waits no more
        try:
            value, error = task(), ""
        except Exception as problem:
            value, error = None, f"{type(problem).__name__}: {problem}"
        writer.send((value, error, _peak_memory_mb()))


def _peak_memory_mb() -> float:
    """Largest resident size of this process, 0 without /proc (getrusage would count the parent's too)."""
    with contextlib.suppress(OSError), open("/proc/self/status", encoding="ascii") as status:
        for line in status:
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) / 1024
    return 0.0
