"""Ctrl-C, SIGTERM, SIGHUP and the wall limit: each ends a run by a KeyboardInterrupt, and its record is kept."""

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.connection import wait
from types import FrameType
from typing import NoReturn

EXIT_INTERRUPTED = 130  # what a shell reports of a program that Ctrl-C ended
STOPPING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
WALL_LIMIT_SIGNAL = signal.SIGALRM  # what a parent sends to a run that has taken too long
BURST = 0.5  # seconds: signals that come so soon after one that counted are the same request


class WallLimit(KeyboardInterrupt):
    """The run has taken longer than its parent allows."""


class _Requests:
    """Tells requests to stop from their repetitions: a key held down, or a shell and a parent that both pass one on."""

    def __init__(self) -> None:
        self.count = 0
        self._last = float("-inf")

    def new(self) -> bool:
        """Whether a signal that comes now is a new request."""
        now = time.monotonic()
        if now < self._last + BURST:
            return False
        self.count, self._last = self.count + 1, now
        return True


_program: _Requests | None = None  # those of a `stoppable` program


@contextmanager
def stoppable() -> Iterator[None]:
    """For a whole program: Ctrl-C, SIGTERM and SIGHUP (if not ignored, as by nohup) raise KeyboardInterrupt once each.

    Afterwards they are ignored: what was to be kept is kept, and the exit code is to be that of the program.
    """
    global _program
    requests = _program = _Requests()

    def stop(_number: int, _frame: FrameType | None) -> None:
        if requests.new():
            raise KeyboardInterrupt

    heard = [number for number in STOPPING if signal.getsignal(number) is not signal.SIG_IGN]
    for number in heard:
        signal.signal(number, stop)
    try:
        yield
    finally:
        for number in heard:
            signal.signal(number, signal.SIG_IGN)


def listen_to_parent() -> None:
    """In a child process: SIGTERM, by which the parent passes on that it was stopped, its death, and the wall limit."""

    def stop(_number: int, _frame: FrameType | None) -> NoReturn:
        raise KeyboardInterrupt

    def too_long(_number: int, _frame: FrameType | None) -> NoReturn:
        raise WallLimit

    signal.signal(signal.SIGTERM, stop)
    signal.signal(WALL_LIMIT_SIGNAL, too_long)
    if (parent := multiprocessing.parent_process()) is not None:
        threading.Thread(target=_follow, args=(parent.sentinel,), daemon=True).start()


def _follow(sentinel: int) -> None:
    """Wait for the parent's death, of which it could not tell, and end as if it had."""
    wait([sentinel])
    os.kill(os.getpid(), signal.SIGTERM)


@contextmanager
def signals_deferred() -> Iterator[None]:
    """Signals that stop a run come at the end of it: in the middle a record would be torn.

    They are noted by handlers. To block them would not do: another thread, as libraries start them, would take them.
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


late_imports = signals_deferred  # in the middle of their import libraries in C++ swallow signals, or die of them


@contextmanager
def interruptible() -> Iterator[Callable[[], None]]:
    """A check that raises KeyboardInterrupt if Ctrl-C came since; the second Ctrl-C does so where it strikes."""
    requests = _program or _Requests()
    before_us = requests.count

    def note(_number: int, _frame: FrameType | None) -> None:
        if requests.new() and requests.count > before_us + 1:
            raise KeyboardInterrupt

    def check() -> None:
        if requests.count > before_us:
            raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, note)
    try:
        yield check
    finally:
        signal.signal(signal.SIGINT, before)
