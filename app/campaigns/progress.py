"""The progress of many runs on stderr: a line a run, and how many came out, how fast, and how long it will take."""

import sys
import time
from typing import Any

from regrasp.app.campaigns.statistics import wilson_interval
from regrasp.interfaces.quote import printable


class Progress:
    """On a terminal a bar under the lines; else a summary once a minute.

    `quiet` shows nothing but `note`; without `counted` no successes are told, as of runs that have no expectations.
    """

    def __init__(self, quiet: bool = False, seconds_of_summary: float = 60.0, counted: bool = True) -> None:
        self.done = self.succeeded = 0  # in all, and as expected
        self._quiet, self._counted, self._every = quiet, counted, seconds_of_summary
        self._total = self._before = 0
        self._began = self._told = time.monotonic()
        self._bar: Any = None

    def begin(self, total: int, done_before: int, succeeded_before: int) -> None:
        """There are `total` runs, of which the store holds some."""
        self._total, self.done, self._before = total, done_before, done_before
        self.succeeded = succeeded_before
        self._began = self._told = time.monotonic()
        if done_before:
            self.note(f"{done_before} of {total} are done already")
        if not self._quiet and sys.stderr.isatty() and done_before < total:
            from rich.console import Console
            from rich.progress import BarColumn, TextColumn
            from rich.progress import Progress as Bar

            console = Console(stderr=True, highlight=False, markup=False)
            self._bar = Bar(BarColumn(), TextColumn("{task.description}"), console=console, transient=True)
            self._task = self._bar.add_task(f"0 of {total}", total=total, completed=done_before)
            self._bar.start()

    def ended(self, title: str, words: str, succeeded: bool) -> None:
        """A run has ended."""
        self.done += 1
        self.succeeded += succeeded
        self._line(f"[{self.done}/{self._total}] {title}: {words}")
        if self._bar is not None:
            self._bar.update(self._task, completed=self.done, description=self.summary())
        elif time.monotonic() - self._told >= self._every and self.done < self._total:
            self._told = time.monotonic()
            self._line(self.summary())

    def note(self, text: str) -> None:
        """Say something."""
        self._print(text)

    def close(self) -> None:
        """Take the bar away."""
        if self._bar is not None:
            self._bar.stop()
            self._bar = None

    def summary(self) -> str:
        """How many are done, came out as expected, a minute, and how long the rest takes."""
        here = self.done - self._before
        minutes = (time.monotonic() - self._began) / 60
        low, high = wilson_interval(self.succeeded, self.done)
        left = (self._total - self.done) * minutes / here if here else 0.0
        share = f"{self.succeeded} as expected (95 % interval {100 * low:.0f} to {100 * high:.0f} %); "
        return (
            f"{self.done} of {self._total} done; {share if self._counted else ''}"
            f"{here / minutes:.1f} a minute, {_span(left)} left"
        )

    def _line(self, text: str) -> None:
        if not self._quiet:
            self._print(text)

    def _print(self, text: str) -> None:
        if self._bar is not None:
            self._bar.console.print(printable(text), soft_wrap=True)
            return
        try:
            print(printable(text), file=sys.stderr, flush=True)
        except BrokenPipeError:  # the reader of stderr has gone: end as by Ctrl-C, with what is done
            raise KeyboardInterrupt from None


def _span(minutes: float) -> str:
    """A span of time in words."""
    if minutes < 2:
        return f"{60 * minutes:.0f} s"
    return f"{minutes:.0f} min" if minutes < 120 else f"{minutes // 60:.0f} h {minutes % 60:.0f} min"
