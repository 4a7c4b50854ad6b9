"""A run's attempts as lines: grouped by where in the tree they stand, with times aligned and repeats folded."""

import textwrap
from bisect import bisect_left, bisect_right
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from app.record import Attempt
from app.record_reader import Event

Names = tuple[str, ...]  # a path's parts
STATUS = {"INVALID": "stopped"}
MARGIN = 19  # columns of the two times
MOST_EVENTS = 6  # shown of one attempt
MOST_ATTEMPTS = 500  # shown of a run
LONGEST = 1000  # characters of a text from the record
TOLD_ELSEWHERE = ("failed", "begin", "end")


@dataclass(frozen=True)
class _Round:
    """Attempts up to the next one that stands earlier in the tree: there `again` begins anew."""

    again: Names | None
    attempts: tuple[Attempt, ...]

    def signature(self) -> Any:
        """What makes two rounds the same: all but times and numbers."""
        return self.again, [(a.path, a.status, a.cause and a.cause.code) for a in self.attempts]


def timeline(attempts: Sequence[Attempt], events: Sequence[Event], width: int) -> Iterator[str]:
    """Lines of at most `width` columns: begin and end of each attempt, and below it its cause and its events."""
    if len(attempts) > MOST_ATTEMPTS:
        yield f"{'':{MARGIN}}{len(attempts) - MOST_ATTEMPTS} earlier attempts are left out; --json has them all"
        attempts = attempts[-MOST_ATTEMPTS:]
    groups = _Groups(attempts)
    count: Counter[Names] = Counter()
    by_node: dict[str, list[Event]] = {}
    for event in events:
        by_node.setdefault(event.node, []).append(event)
    for _, same in groupby(groups.rounds(), key=_Round.signature):
        first, *more = same
        count[first.again or ()] += 1
        shown: Names = () if first.again is None else first.again[:-1]
        for attempt in first.attempts:
            headings = groups.headings(attempt)
            above = 0
            for depth, heading in enumerate(headings):
                if shown[: len(heading)] != heading:
                    again = f"  again, round {1 + count[heading]}" if heading == first.again else ""
                    yield f"{'':{MARGIN}}{'  ' * depth}{'/'.join(heading[above:])}{again}"
                above = len(heading)
            shown = headings[-1] if headings else ()
            yield from _lines(attempt, above, len(headings), by_node.get(attempt.path, []), width)
        if more:
            count[first.again or ()] += len(more)
            begin, end = more[0].attempts[0].started, max(a.ended for a in more[-1].attempts)
            yield f"{begin:8.2f} {end:8.2f}  and the same again, {len(more)} more time{'s' * (len(more) > 1)}"


class _Groups:
    """Where the attempts' paths branch, and in which order their parts came first."""

    def __init__(self, attempts: Sequence[Attempt]) -> None:
        self._attempts = attempts
        self._order: dict[Names, dict[str, int]] = {}  # of each node its children's names, and their order
        for attempt in attempts:
            names = _names(attempt)
            for depth, name in enumerate(names):
                siblings = self._order.setdefault(names[:depth], {})
                siblings.setdefault(name, len(siblings))

    def headings(self, attempt: Attempt) -> list[Names]:
        """The attempt's ancestors at which paths part, from the top; a chain of only children is one."""
        names = _names(attempt)
        return [names[:depth] for depth in range(1, len(names)) if len(self._order[names[:depth]]) > 1]

    def rounds(self) -> Iterator[_Round]:
        """The attempts, parted where one begins at a place in the tree before that of the attempt that it follows."""
        again: Names | None = None
        members: list[Attempt] = []
        for attempt in self._attempts:
            if members and (begins := self._begins_anew(members[-1], attempt)) is not None:
                yield _Round(again, tuple(members))
                again, members = begins, []
            members.append(attempt)
        if members:
            yield _Round(again, tuple(members))

    def _begins_anew(self, before: Attempt, attempt: Attempt) -> Names | None:
        """The node that both stand under when `attempt` is a new execution of it; None for one beside or after."""
        a, b = _names(before), _names(attempt)
        depth = next((i for i, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), min(len(a), len(b)))
        if attempt.started < before.ended:
            return None
        if depth == len(b):
            return b
        order = self._order[b[:depth]]
        return b[:depth] if order[b[depth]] < order[a[depth]] else None


def _names(attempt: Attempt) -> Names:
    return tuple(attempt.path.split("/"))


def _lines(attempt: Attempt, above: int, depth: int, events: Sequence[Event], width: int) -> Iterator[str]:
    """The attempt's own line, its events and its cause."""
    name = "  " * depth + "/".join(_names(attempt)[above:])
    status = STATUS.get(attempt.status, attempt.status)
    times = f", {attempt.times} times" if attempt.times > 1 else ""
    yield f"{attempt.started:8.2f} {attempt.ended:8.2f}  {name:<36} {status}{times}"
    indent = " " * (MARGIN + 2 * depth + 4)
    first = bisect_left(events, attempt.started, key=_time)
    mine = [e for e in events[first : bisect_right(events, attempt.ended, key=_time)] if e.event not in TOLD_ELSEWHERE]
    for event in mine[:MOST_EVENTS]:
        yield from wrapped(f"{event.t:.2f} s {event_text(event)}", width, indent)
    if len(mine) > MOST_EVENTS:
        yield f"{indent}and {len(mine) - MOST_EVENTS} events more"
    if attempt.cause:
        yield from wrapped(f"{attempt.cause.code}: {attempt.cause.message}", width, indent)


def _time(event: Event) -> float:
    return event.t


def wrapped(text: str, width: int, indent: str = "", further: str = "  ") -> list[str]:
    """The text in lines of at most `width` columns, the first after `indent`, the others after `further` besides."""
    text = text if len(text) <= LONGEST else text[: LONGEST - 3] + "..."
    width = max(width, len(indent) + len(further) + 20)
    return textwrap.wrap(text, width, initial_indent=indent, subsequent_indent=indent + further)


def event_text(event: Event) -> str:
    """An event in words: its name, and its values as name=value."""
    values = ", ".join(f"{name}={value}" for name, value in event.values.items())
    return f"{event.event}: {values}" if values else event.event
