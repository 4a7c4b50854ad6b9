"""Tasks in processes, one at a time in each: py_trees' blackboard and PyBullet's globals exist once per process."""

import contextlib
import gc
import math
import os
import signal
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
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
    killed: bool = False  # by somebody else, as by the kernel when memory ends


@dataclass(frozen=True)
class Renewal:
    """When a process that has done tasks gets no further one. It never gets one after an error or the wall limit."""

    tasks: int = 50  # that it has done; choice: imports take 2 s, so 0.04 s a task
    growth_mb: float = 300.0  # of its memory since its first task ended; choice: a run takes 450


@dataclass(eq=False)
class _Worker:
    """A process, and the task at which it is: `number` is None while it has none."""

    process: Any
    pipe: "Connection[Any, Any]"
    number: int | None = None
    deadline: float = math.inf  # on the monotonic clock
    signalled: bool = False  # that its time is over
    tasks: int = 0  # that it was given
    memory_mb: float | None = None  # when its first task had ended


def run_each(
    tasks: Iterable[Callable[[], T]],
    jobs: int,
    wall_limit: float = math.inf,
    grace: float = 10.0,
    renewal: Renewal = Renewal(),
) -> Generator[Done[T]]:
    """Run picklable tasks, at most `jobs` at a time, and yield each as it ends, in any order.

    A process does several tasks one after the other; the next task is taken from `tasks` when a process is free. A
    task that raises or crashes yields its error; the others go on. A task that takes longer than `wall_limit` seconds
    of wall time gets a `WallLimit`; if it has not ended `grace` seconds later, it is killed. When the caller closes
    the iterator, or at Ctrl-C, the running tasks get a KeyboardInterrupt and have `grace` seconds to end.
    """
    pool, waiting = _Pool(wall_limit, renewal), enumerate(tasks)
    try:
        more = True
        while more or pool.busy:
            while more and len(pool.busy) < jobs:
                if more := (task := next(waiting, None)) is not None:
                    pool.give(*task)
            if pool.busy:
                for ready in wait([worker.pipe for worker in pool.busy], _seconds_to_deadline(pool.busy)):
                    yield pool.received(next(worker for worker in pool.busy if worker.pipe is ready))
                _enforce_deadlines(pool.busy, grace)
    finally:
        for worker in pool.idle:
            worker.pipe.close()  # it ends by itself
        _stop([worker.process for worker in pool.busy], grace)
        for worker in pool.idle:
            worker.process.join()


@dataclass
class _Pool:
    """The processes of a `run_each`."""

    wall_limit: float
    renewal: Renewal
    busy: list[_Worker] = field(default_factory=list)
    idle: list[_Worker] = field(default_factory=list)

    def give(self, number: int, task: Callable[[], Any]) -> None:
        """Have a process do a task: an idle one that lives, or a new one."""
        while self.idle:
            worker = self.idle.pop()
            with contextlib.suppress(BrokenPipeError, ConnectionResetError):  # it was killed while it waited
                worker.pipe.send(task)
                break
            worker.process.join()
        else:
            worker = _started(task)
        worker.number, worker.deadline = number, time.monotonic() + self.wall_limit
        worker.tasks += 1
        self.busy.append(worker)

    def received(self, worker: _Worker) -> Done[Any]:
        """What a busy process sent, or that it died. It is idle now if it may do another task, else it ends."""
        try:
            value, error, peak, memory = worker.pipe.recv()
        except (EOFError, ConnectionResetError):
            value, error, peak, memory = None, "", 0.0, math.inf
        self.busy.remove(worker)
        if worker.memory_mb is None:
            worker.memory_mb = memory
        grown = memory - worker.memory_mb > self.renewal.growth_mb
        if value is None or worker.signalled or worker.tasks >= self.renewal.tasks or grown:
            worker.pipe.close()
            worker.process.join()
        else:
            self.idle.append(worker)
        timed_out = value is None and worker.signalled
        if timed_out:
            error = f"stopped after {self.wall_limit:g} s of wall time"
        elif value is None and not error:
            error = _death(worker.process.exitcode)
        assert worker.number is not None
        killed = value is None and not worker.signalled and worker.process.exitcode == -signal.SIGKILL
        return Done(worker.number, value, error, peak, timed_out, killed)


def _death(exit_code: int) -> str:
    """How a process died, in words; a negative exit code is that of a signal."""
    if exit_code == -signal.SIGKILL:
        return "the process was killed from outside (SIGKILL), as when memory runs out"
    name = next((f" ({one.name})" for one in signal.Signals if one == -exit_code), "")
    return f"the process died with exit code {exit_code}{name}"


def _started(task: Callable[[], Any]) -> _Worker:
    """A new process, at work on its first task."""
    context = get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_child, args=(theirs, task), daemon=True)
    with _signals_blocked():
        process.start()
    theirs.close()  # the child has the only one now: its death shows as an end of file
    return _Worker(process, ours)


def _seconds_to_deadline(workers: Iterable[_Worker]) -> float | None:
    """Wall-clock seconds until the first worker's deadline; None if none has one."""
    first = min(worker.deadline for worker in workers)
    return None if first == math.inf else max(0.0, first - time.monotonic())


def _enforce_deadlines(workers: Iterable[_Worker], grace: float) -> None:
    """Signal the workers whose time is over; kill those that were signalled `grace` seconds ago and go on."""
    now = time.monotonic()
    for worker in workers:
        if now >= worker.deadline:
            if worker.signalled:
                worker.process.kill()
            else:
                os.kill(worker.process.pid, WALL_LIMIT_SIGNAL)
            worker.signalled, worker.deadline = True, math.inf if worker.signalled else now + grace


_ASK_AGAIN = 4.0  # s; choice: a run that was asked writes its record within two


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


def _stop(processes: Sequence[Any], grace: float) -> None:
    """End processes: ask them, some seconds later once more, and kill those that still live after `grace` s.

    What the first request raises is lost when it comes in a callback from a C++ library, such as at an import.
    """
    until = time.monotonic() + grace
    while (alive := [process for process in processes if process.is_alive()]) and time.monotonic() < until:
        for process in alive:
            process.terminate()
        again = min(until, time.monotonic() + _ASK_AGAIN)
        for process in alive:
            process.join(max(0.0, again - time.monotonic()))
    for process in processes:
        if process.is_alive():
            process.kill()
        process.join()


def _child(pipe: "Connection[Any, Any]", task: Callable[[], Any]) -> None:
    """Do the task, and each that comes through the pipe, until the parent closes it or a task raises."""
    with contextlib.suppress(KeyboardInterrupt, BrokenPipeError, EOFError):  # the parent waits no more
        listen_to_parent()
        while True:
            _forget_peak_memory()
            try:
                value, error = task(), ""
            except Exception as problem:
                value, error = None, f"{type(problem).__name__}: {problem}"
            pipe.send((value, error, _memory_mb("VmHWM:"), _memory_mb("VmRSS:")))
            if error:
                return
            del value
            gc.collect()  # a tree's nodes know each other: their memory, 40 MB a run, would come back only much later
            task = pipe.recv()


def _forget_peak_memory() -> None:
    """Have the kernel count the largest resident size of this process anew, where it can."""
    with contextlib.suppress(OSError), open("/proc/self/clear_refs", "w", encoding="ascii") as file:
        file.write("5")


def _memory_mb(line: str) -> float:
    """A line of this process's /proc status, 0 without /proc (getrusage would count the parent's peak, too)."""
    with contextlib.suppress(OSError), open("/proc/self/status", encoding="ascii") as status:
        for text in status:
            if text.startswith(line):
                return int(text.split()[1]) / 1024
    return 0.0
