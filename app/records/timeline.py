"""A run's attempts as lines, grouped by their place in the tree; times are aligned, repeated rounds are folded."""

import textwrap
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from regrasp.app.records.history import NodeHistory
from regrasp.app.records.reader import Event
from regrasp.app.records.result import Attempt
from regrasp.app.records.summary import event_words

PathParts = tuple[str, ...]  # a path's parts
STATUS_WORDS = {"INVALID": "stopped", "RUNNING": "still running"}
TIME_COLUMNS = 19  # width of the two times
SHOWN_ELSEWHERE = ("failed", "begin", "end")


@dataclass(frozen=True)
class TimelineParameters:
    """How much of a long run is shown."""

    max_events: int = 6  # of one attempt; choice: the attempts stay in view
    max_attempts: int = 500  # of a run, the last ones; choice: enough for any run that somebody reads


@dataclass(frozen=True)
class _Round:
    """Attempts up to the next round of a loop; `again` is what the loop began anew, for the `number`th time."""

    again: PathParts
    number: int
    attempts: tuple[Attempt, ...]

    def signature(self) -> Any:
        """What makes two rounds the same: all but times and numbers."""
        return self.again, [(a.path, a.status, a.cause and a.cause.code) for a in self.attempts]


def timeline(
    attempts: Sequence[Attempt],
    events: Sequence[Event],
    history: NodeHistory,
    width: int,
    parameters: TimelineParameters = TimelineParameters(),
) -> Iterator[str]:
    """Lines of at most `width` columns: begin and end of each attempt, and below it its events and its cause."""
    most = parameters.max_attempts
    if len(attempts) > most:
        yield f"{'':{TIME_COLUMNS}}{len(attempts) - most} earlier attempts are left out; --json has them all"
        attempts = attempts[-most:]
    headings = _Headings(attempts)
    by_node: dict[str, list[Event]] = {}
    for event in events:
        by_node.setdefault(event.node, []).append(event)
    inner = _inner_events(attempts, events)
    for _, same in groupby(_rounds(attempts, history), key=_Round.signature):
        first, *more = same
        shown, again = headings.reopened(first)
        for attempt in first.attempts:
            above, open_now = 0, headings.of(attempt)
            for depth, heading in enumerate(open_now):
                yield from _due(inner, "/".join(heading), attempt.started, open_now, width)
                if shown[: len(heading)] != heading:
                    note = f"  again, round {first.number}" if heading == again else ""
                    yield f"{'':{TIME_COLUMNS}}{'  ' * depth}{'/'.join(heading[above:])}{note}"
                above = len(heading)
            shown = open_now[-1] if open_now else ()
            yield from _due(inner, attempt.path, attempt.started, open_now, width)
            own = by_node.get(attempt.path, [])
            yield from _lines(attempt, above, len(open_now), own, width, parameters.max_events)
        if more:
            begin, end = more[0].attempts[0].started, max(a.ended for a in more[-1].attempts)
            yield f"{begin:8.2f} {end:8.2f}  and the same again, {len(more)} more time{'s' * (len(more) > 1)}"
            inner = [event for event in inner if event.t > end]
    for event in inner:
        yield from _event_lines(event, 0, width)


def _inner_events(attempts: Sequence[Attempt], events: Sequence[Event]) -> list[Event]:
    """The events of nodes that have children, such as a plan that was made."""
    leaves = {attempt.path for attempt in attempts}
    above = {path[:end] for path in leaves for end, character in enumerate(path) if character == "/"}
    return [event for event in events if event.node in above and event.event not in SHOWN_ELSEWHERE]


def _due(inner: list[Event], path: str, until: float, headings: Sequence[PathParts], width: int) -> Iterator[str]:
    """Take out of `inner`, and tell, the events up to that second of nodes above `path`."""
    while inner and inner[0].t <= until and path.startswith(f"{inner[0].node}/"):
        event = inner.pop(0)
        depth = sum(event.node.startswith("/".join(heading)) for heading in headings)
        yield from _event_lines(event, depth, width)


def _event_lines(event: Event, depth: int, width: int) -> list[str]:
    return wrapped(f"{event.t:.2f} s {event_text(event)}", width, " " * (TIME_COLUMNS + 2 * depth))


def _rounds(attempts: Sequence[Attempt], history: NodeHistory) -> Iterator[_Round]:
    """The attempts, parted where a loop begins what is below it anew."""
    again: tuple[PathParts, int] = ((), 1)
    members: list[Attempt] = []
    for attempt in attempts:
        if members and (new := history.new_round(attempt.path, members[-1].started, attempt.started)):
            yield _Round(*again, tuple(members))
            again, members = (tuple(new[0].split("/")), new[1]), []
        members.append(attempt)
    if members:
        yield _Round(*again, tuple(members))


class _Headings:
    """The ancestors at which the attempts' paths part; a chain of only children is one."""

    def __init__(self, attempts: Sequence[Attempt]) -> None:
        self._below: dict[PathParts, set[str]] = {}
        for names in map(_names, attempts):
            for depth in range(len(names)):
                self._below.setdefault(names[:depth], set()).add(names[depth])

    def of(self, attempt: Attempt) -> list[PathParts]:
        """From the top."""
        names = _names(attempt)
        return [names[:depth] for depth in range(1, len(names)) if len(self._below[names[:depth]]) > 1]

    def reopened(self, group: _Round) -> tuple[PathParts, PathParts]:
        """What stays open of the headings above when a round begins, and the heading that it begins with."""
        if not group.again:
            return (), ()
        heading = next((h for h in self.of(group.attempts[0]) if len(h) >= len(group.again)), ())
        return heading[:-1], heading


def _names(attempt: Attempt) -> PathParts:
    return tuple(attempt.path.split("/"))


def _lines(attempt: Attempt, above: int, depth: int, events: Sequence[Event], width: int, most: int) -> Iterator[str]:
    """The attempt's own line, at most `most` of its events, and its cause."""
    name = "  " * depth + "/".join(_names(attempt)[above:])
    status = STATUS_WORDS.get(attempt.status, attempt.status)
    times = f", {attempt.times} times" if attempt.times > 1 else ""
    yield f"{attempt.started:8.2f} {attempt.ended:8.2f}  {name:<36} {status}{times}"
    indent = " " * (TIME_COLUMNS + 2 * depth + 4)
    first = bisect_left(events, attempt.started, key=_time)
    mine = [e for e in events[first : bisect_right(events, attempt.ended, key=_time)] if e.event not in SHOWN_ELSEWHERE]
    for event in mine[:most]:
        yield from wrapped(f"{event.t:.2f} s {event_text(event)}", width, indent)
    if len(mine) > most:
        yield f"{indent}and {len(mine) - most} more events"
    if attempt.cause:
        yield from wrapped(f"{attempt.cause.code}: {attempt.cause.message}", width, indent)


def _time(event: Event) -> float:
    return event.t


def wrapped(text: str, width: int, indent: str = "", further: str = "  ", longest: int = 1000) -> list[str]:
    """The text in lines of at most `width` columns, each after `indent`, all but the first after `further`, too.

    A text of more than `longest` characters is cut.
    """
    text = text if len(text) <= longest else text[: longest - 3] + "..."
    width = max(width, len(indent) + len(further) + 20)
    return textwrap.wrap(text, width, initial_indent=indent, subsequent_indent=indent + further)


def event_text(event: Event) -> str:
    """An event in words: its name, and its values as name=value."""
    return event_words(event.event, event.values)
