"""What a running episode shows on stderr, and how Ctrl-C reaches it."""

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from rich.console import Console

Progress = Callable[[float, str], None]  # simulated seconds, active leaf; called at each tick
QUIET_SECONDS = 5.0  # simulated, between two lines of a leaf that goes on


@contextmanager
def shown_progress(quiet: bool) -> Iterator[Progress]:
    """A callback for `run_episode`: one live line on a terminal, else a line a leaf; `quiet` shows nothing.

    While it is open, Ctrl-C raises KeyboardInterrupt from the callback, so between two ticks; a second one at once.
    """
    console = Console(stderr=True, highlight=False, markup=False)
    with interruptible() as check:
        if quiet:
            yield lambda _time, _leaf: check()
        elif console.is_terminal:
            with console.status("starting") as status:

                def live(time: float, leaf: str) -> None:
                    check()
                    status.update(f"{time:7.1f} s  {leaf}")

                yield live
        else:
            lines = _Lines()

            def plain(time: float, leaf: str) -> None:
                check()
                lines.show(time, leaf)

            yield plain


class _Lines:
    """A line when the leaf changes, at most one a simulated second, and one now and then while it goes on."""

    def __init__(self) -> None:
        self.time = float("-inf")
        self.leaf = ""

    def show(self, time: float, leaf: str) -> None:
        if time - self.time >= (QUIET_SECONDS if leaf == self.leaf else 1.0):
            self.time, self.leaf = time, leaf
            try:
                print(f"{time:7.1f} s  {leaf}", file=sys.stderr, flush=True)
            except BrokenPipeError:  # who watched has gone: as Ctrl-C, with the record kept
                raise KeyboardInterrupt from None


@contextmanager
def late_imports() -> Iterator[None]:
    """Ctrl-C waits for the end of it: in the middle of their import libraries in C++ swallow it, or die of it."""
    with interruptible() as check:
        yield
        check()


@contextmanager
def interruptible() -> Iterator[Callable[[], None]]:
    """A check that raises KeyboardInterrupt if Ctrl-C came since; the second Ctrl-C does so where it strikes."""
    asked = False

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal asked
        asked = True
        signal.signal(signal.SIGINT, signal.default_int_handler)

    def check() -> None:
        if asked:
            raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, note)
    try:
        yield check
    finally:
        signal.signal(signal.SIGINT, before)
