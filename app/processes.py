"""Work in processes of its own, one a task: py_trees' blackboard and PyBullet's globals are one per process."""

import contextlib
import signal
from collections.abc import Callable, Generator, Iterator, Sequence
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection, wait
from typing import Any, Generic, NamedTuple, NoReturn, TypeVar

T = TypeVar("T")


class Done(NamedTuple, Generic[T]):
    """How one task ended: its number, what it returned (None where it died), the error in words, peak memory in MB."""

    number: int
    value: T | None
    error: str
    peak_memory_mb: float


def run_each(tasks: Sequence[Callable[[], T]], jobs: int) -> Generator[Done[T]]:
    """Run picklable tasks, at most `jobs` at a time, and yield each as it ends, in whatever order.

    A task that raises or crashes yields its error; the others go on. When the caller closes the iterator or Ctrl-C
    comes, those under way get a KeyboardInterrupt and ten seconds to put their things in order.
    """
    context = get_context("spawn")
    waiting = list(enumerate(tasks))
    running: dict[Any, tuple[int, Any]] = {}
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                number, task = waiting.pop(0)
                reader, writer = context.Pipe(duplex=False)
                process = context.Process(target=_child, args=(writer, task), daemon=True)
                with _sigint_blocked():
                    process.start()
                writer.close()  # the child has the only one now: its death shows as an end of file
                running[reader] = number, process
            for ready in wait(list(running)):
                number, process = running[ready]
                yield _received(number, ready, process)
                del running[ready]
    finally:
        _stop([process for _, process in running.values()])


@contextlib.contextmanager
def _sigint_blocked() -> Iterator[None]:
    """What is started meanwhile never hears of a terminal's Ctrl-C, which reaches all of us; here it comes afterwards.

    Ignored by the child itself it would come while it still imports.
    """
    resource_tracker.ensure_running()  # its start would end the block
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _received(number: int, reader: Any, process: Any) -> Done[Any]:
    try:
        value, error, peak = reader.recv()
    except EOFError:
        value, error, peak = None, "", 0.0
    process.join()
    reader.close()
    if value is None and not error:
        error = f"the process died with exit code {process.exitcode}"
    return Done(number, value, error, peak)


def _stop(processes: Sequence[Any]) -> None:
    for process in processes:
        process.terminate()
    for process in processes:
        process.join(10)
        if process.is_alive():
            process.kill()
            process.join()


def _child(writer: "Connection[Any, Any]", task: Callable[[], Any]) -> None:
    def interrupt(_number: int, _frame: object) -> NoReturn:
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, interrupt)  # the parent passes Ctrl-C on once
    with contextlib.suppress(KeyboardInterrupt):
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
