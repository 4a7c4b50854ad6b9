"""Ctrl-C, SIGTERM, SIGHUP and the wall limit: each ends a run by a KeyboardInterrupt, and its record is kept."""

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NoReturn

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


def listen() -> None:
    """Take SIGTERM and SIGHUP as Ctrl-C from now on; SIGHUP only where it was not ignored, as by nohup."""
    requests = _Requests()

    def stop(_number: int, _frame: FrameType | None) -> None:
        if requests.new():
            raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, stop)
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        signal.signal(signal.SIGHUP, stop)


def listen_to_parent() -> None:
    """In a child process: SIGTERM, by which the parent passes on that it was stopped, and the wall limit."""

    def stop(_number: int, _frame: FrameType | None) -> NoReturn:
        raise KeyboardInterrupt

    def too_long(_number: int, _frame: FrameType | None) -> NoReturn:
        raise WallLimit

    signal.signal(signal.SIGTERM, stop)
    signal.signal(WALL_LIMIT_SIGNAL, too_long)


@contextmanager
def held_back() -> Iterator[None]:
    """Signals that stop a run wait until the end of it: a record is written in one piece."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {*STOPPING, WALL_LIMIT_SIGNAL})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def late_imports() -> Iterator[None]:
    """Signals that stop us wait for the end of imports: in their middle libraries in C++ swallow them, or die of it."""
    asked = False

    def note(_number: int, _frame: FrameType | None) -> None:
        nonlocal asked
        asked = True

    before = {number: signal.getsignal(number) for number in STOPPING}
    for number, handler in before.items():
        if handler is not signal.SIG_IGN:
            signal.signal(number, note)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if asked:
        raise KeyboardInterrupt


@contextmanager
def interruptible() -> Iterator[Callable[[], None]]:
    """A check that raises KeyboardInterrupt if Ctrl-C came since; the second Ctrl-C does so where it strikes."""
    requests = _Requests()

    def note(_number: int, _frame: FrameType | None) -> None:
        if requests.new() and requests.count > 1:
            raise KeyboardInterrupt

    def check() -> None:
        if requests.count:
            raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, note)
    try:
        yield check
    finally:
        signal.signal(signal.SIGINT, before)
