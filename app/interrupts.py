"""Ctrl-C, SIGTERM, SIGHUP and the wall limit: each ends a run by a KeyboardInterrupt, and its record is kept."""

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NoReturn

EXIT_INTERRUPTED = 130  # what a shell reports of a program that Ctrl-C ended
STOPPING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
WALL_LIMIT_SIGNAL = signal.SIGALRM  # what a parent sends to a run that has taken too long


class WallLimit(KeyboardInterrupt):
    """The run has taken longer than its parent allows."""


class StopRequests:
    """Counts requests to stop, and not their repetitions: a key held down, or a shell and a parent that both signal.

    A signal within `burst` seconds after one that counted is the same request.
    """

    def __init__(self, burst: float = 0.5) -> None:
        self.count = 0
        self.burst = burst
        self._last = float("-inf")

    def is_new(self) -> bool:
        """Whether a signal that comes now is a new request."""
        now = time.monotonic()
        if now < self._last + self.burst:
            return False
        self.count, self._last = self.count + 1, now
        return True


_program: StopRequests | None = None  # of the `stoppable` program, if this is one
_raised: type[KeyboardInterrupt] | None = None  # what the last signal to stop has raised in this process


def _interrupt(kind: type[KeyboardInterrupt] = KeyboardInterrupt) -> NoReturn:
    global _raised
    _raised = kind
    raise kind


def raise_if_swallowed() -> None:
    """Raise once more what a signal has raised; for a loop that only goes on because the exception was lost.

    Python drops an exception that comes in a finaliser or in a callback from a C++ library.
    """
    if _raised is not None:
        raise _raised


@contextmanager
def stoppable() -> Iterator[None]:
    """For a whole program: Ctrl-C, SIGTERM and SIGHUP (if not ignored, as by nohup) raise KeyboardInterrupt once each.

    When the context ends they are ignored: by then the record is written, and the program's exit code shall count.
    """
    global _program, _raised
    requests, _raised = StopRequests(), None
    _program = requests

    def stop(_number: int, _frame: FrameType | None) -> None:
        if requests.is_new():
            _interrupt()

    heard = [number for number in STOPPING if signal.getsignal(number) is not signal.SIG_IGN]
    for number in heard:
        signal.signal(number, stop)
    try:
        yield
    finally:
        for number in heard:
            signal.signal(number, signal.SIG_IGN)


def listen_to_parent() -> None:
    """In a child process: react to SIGTERM (the parent was stopped), to the parent's death, and to the wall limit."""

    from multiprocessing import parent_process

    def stop(_number: int, _frame: FrameType | None) -> NoReturn:
        _interrupt()

    def too_long(_number: int, _frame: FrameType | None) -> NoReturn:
        _interrupt(WallLimit)

    signal.signal(signal.SIGTERM, stop)
    signal.signal(WALL_LIMIT_SIGNAL, too_long)
    if (parent := parent_process()) is not None:
        threading.Thread(target=_follow, args=(parent.sentinel,), daemon=True).start()


def _follow(sentinel: int) -> None:
    """Wait for the parent's death, then end as if the parent had sent SIGTERM."""
    from multiprocessing.connection import wait

    wait([sentinel])
    os.kill(os.getpid(), signal.SIGTERM)


@contextmanager
def signals_deferred() -> Iterator[None]:
    """Defer the signals that stop a run to the end of this context: in its middle a record would be left half written.

    Handlers note them. Blocking them would not help: then another thread, which some library started, would get them.
    """
    if threading.current_thread() is not threading.main_thread():  # others are never interrupted
        yield
        return
    came: list[int] = []
    before = {number: signal.getsignal(number) for number in (*STOPPING, WALL_LIMIT_SIGNAL)}
    for number, handler in before.items():
        if handler is not signal.SIG_IGN:
            signal.signal(number, lambda number, _frame: came.append(number))
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if came:
        signal.raise_signal(came[0])


late_imports = signals_deferred  # C++ libraries swallow signals, or crash, when one comes during their import


@contextmanager
def interruptible() -> Iterator[Callable[[], None]]:
    """Yields a check that raises KeyboardInterrupt if Ctrl-C came meanwhile. A second Ctrl-C raises it at once."""
    requests = _program or StopRequests()
    before_us = requests.count

    def note(_number: int, _frame: FrameType | None) -> None:
        if requests.is_new() and requests.count > before_us + 1:
            raise KeyboardInterrupt

    def check() -> None:
        if requests.count > before_us:
            raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, note)
    try:
        yield check
    finally:
        signal.signal(signal.SIGINT, before)
