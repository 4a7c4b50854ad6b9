"""Shows the progress of an episode on stderr, and ends it at Ctrl-C."""

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from typing import Any

from regrasp.app.cli.options import LogLevel
from regrasp.app.interrupts import interruptible
from regrasp.app.records.summary import event_words
from regrasp.app.run.observers import Observers
from regrasp.interfaces.quote import printable

LEVELS = ("debug", "info", "warning", "error")


@contextmanager
def shown_progress(quiet: bool, level: LogLevel = None) -> Iterator[Observers]:
    """Observers of an episode: one live line on a terminal, else a line a leaf; `quiet` shows nothing.

    Events of `level` and above are shown as lines; None shows none. While the context is open, Ctrl-C raises
    KeyboardInterrupt from the observer's `tick`, so between two ticks of the tree; a second Ctrl-C raises it at once.
    """
    from rich.console import Console

    console = Console(stderr=True, highlight=False, markup=False)
    shown_levels = LEVELS[LEVELS.index(level) :] if level else ()

    def event(values: Mapping[str, Any]) -> None:
        if values["level"] in shown_levels:
            rest = {name: value for name, value in values.items() if name not in ("t", "level", "event", "node")}
            what = event_words(str(values["event"]), rest)
            told = printable(f"{values['t']:7.2f} s  {values['level']:<7}  {values.get('node') or '-'}  {what}")
            if console.is_terminal:
                console.print(told, soft_wrap=True)
            else:
                _print(told)

    with interruptible() as check:
        if quiet:
            yield Observers(tick=lambda _time, _leaf: check(), event=event)
        elif console.is_terminal:
            with console.status("starting") as status:

                def live(time: float, leaf: str) -> None:
                    check()
                    status.update(f"{time:7.1f} s  {leaf}")

                yield Observers(tick=live, event=event)
        else:
            lines = _Lines()

            def plain(time: float, leaf: str) -> None:
                check()
                lines.show(time, leaf)

            yield Observers(tick=plain, event=event)


@cache
def tell_of_compilation() -> None:
    """From now on say so once, on stderr, if something has to be compiled; the result is kept on disk."""
    from numba.core import event as numba_event

    class Compilation(numba_event.Listener):  # type: ignore[misc,unused-ignore]
        told = False

        def on_start(self, event: Any) -> None:
            if not self.told:
                self.told = True
                _print("compiling, once on this machine: a minute")

        def on_end(self, event: Any) -> None:
            pass

    numba_event.register("numba:compile", Compilation())


class _Lines:
    """Prints a line when the leaf changes, and again while it goes on; `seconds` are simulated, between two lines."""

    def __init__(self, seconds_of_new: float = 1.0, seconds_of_same: float = 5.0) -> None:
        self.seconds_of_new, self.seconds_of_same = seconds_of_new, seconds_of_same
        self.time = float("-inf")
        self.leaf = ""

    def show(self, time: float, leaf: str) -> None:
        if time - self.time >= (self.seconds_of_same if leaf == self.leaf else self.seconds_of_new):
            self.time, self.leaf = time, leaf
            _print(f"{time:7.1f} s  {leaf}")


def _print(line: str) -> None:
    try:
        print(line, file=sys.stderr, flush=True)
    except BrokenPipeError:  # the reader of stderr has gone: end as by Ctrl-C, with the record kept
        raise KeyboardInterrupt from None
