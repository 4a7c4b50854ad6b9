"""Where the wall-clock time of a run goes, by part."""

import functools
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Literal, ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")

Part = Literal["start", "physics", "step loop", "rendering", "perception", "planning", "tree", "record", "film"]


class WallTime:
    """Adds up wall-clock seconds by part. At any time one part runs: what is called in another interrupts it."""

    def __init__(self, part: Part) -> None:
        self.seconds: dict[Part, float] = {}
        self._part, self._since = part, time.perf_counter()
        self.longest_lap, self._lap_since = 0.0, self._since

    def lap(self, counts: bool = True) -> None:
        """A lap, such as the time from one tick to the next, ends here and another begins; `counts`: as the longest."""
        now = time.perf_counter()
        if counts:
            self.longest_lap = max(self.longest_lap, now - self._lap_since)
        self._lap_since = now

    def move(self, part: Part, seconds: float) -> None:
        """Count so much of the time of the part that runs as that part's: for loops in which a switch would cost."""
        self.seconds[self._part] = self.seconds.get(self._part, 0.0) - seconds
        self.seconds[part] = self.seconds.get(part, 0.0) + seconds

    def switch(self, part: Part) -> Part:
        """Go on with that part; returns the one that ran until now."""
        now, before = time.perf_counter(), self._part
        self.seconds[before] = self.seconds.get(before, 0.0) + now - self._since
        self._part, self._since = part, now
        return before


_measured: WallTime | None = None  # a process makes one run at a time


@contextmanager
def measured(part: Part) -> Iterator[WallTime]:
    """While this context is open, the functions of each part are timed; it begins with `part`."""
    global _measured
    before, _measured = _measured, WallTime(part)
    try:
        yield _measured
    finally:
        _measured = before


def move_time(part: Part, seconds: float) -> None:
    """See `WallTime.move`. Without `measured` it does nothing."""
    if _measured is not None:
        _measured.move(part, seconds)


def counts_as(part: Part) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Decorates a function whose time counts as that part's. Without `measured` it does nothing."""

    def decorate(function: Callable[P, T]) -> Callable[P, T]:
        @functools.wraps(function)
        def timed(*args: P.args, **kwargs: P.kwargs) -> T:
            clock = _measured
            if clock is None:
                return function(*args, **kwargs)
            before = clock.switch(part)
            try:
                return function(*args, **kwargs)
            finally:
                clock.switch(before)

        return timed

    return decorate
