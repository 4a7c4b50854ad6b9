"""The course of a run: what happened when, as lanes of a time line, as marks on it, and as lines of a log."""

import re
from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from regrasp.app.records.reader import Event, RunRecord
from regrasp.app.records.result import Attempt
from regrasp.app.records.summary import event_words
from regrasp.app.task.find import words_of

MAX_LANES, MAX_BARS = 60, 1500  # of a time line; choice: more cannot be told apart
MAX_LOG = 2000  # lines
LOOKS = re.compile(r"\b(saw|see|sees|look|looks|looked|found|glimpsed|search|seen)\b")


@dataclass(frozen=True)
class Bar:
    """A span of a lane: from and to (simulated s), how it ended, and what is told of it."""

    start: float
    end: float
    status: str
    title: str


@dataclass
class Lane:
    """A row of the time line: its name, the path of its node, and its bars."""

    name: str
    path: str
    bars: list[Bar] = field(default_factory=list)


@dataclass(frozen=True)
class Mark:
    """Something that happened at a moment: `kind` is failed, fault, plan, look, warning, truth or note."""

    t: float
    kind: str
    node: str
    text: str


def lanes(attempts: Sequence[Attempt]) -> list[Lane]:
    """A lane for each leaf, in the order in which they were first tried; the last `MAX_BARS` attempts."""
    found: dict[str, Lane] = {}
    names = _short_names([attempt.path for attempt in attempts])
    for attempt in attempts[-MAX_BARS:]:
        lane = found.setdefault(attempt.path, Lane(names[attempt.path], attempt.path))
        lane.bars.append(Bar(attempt.started, attempt.ended, attempt.status, _told(attempt)))
    return [*found.values()][:MAX_LANES]


def _told(attempt: Attempt) -> str:
    status = {"INVALID": "stopped", "RUNNING": "still running"}.get(attempt.status, attempt.status.lower())
    times = f", {attempt.times} times" if attempt.times > 1 else ""
    why = f": {attempt.cause.message}" if attempt.cause else ""
    return f"{attempt.path}, {attempt.started:.2f} to {attempt.ended:.2f} s{times}: {status}{why}"


def _short_names(paths: Sequence[str]) -> dict[str, str]:
    """The last name of each path, and the one before it where two paths end alike."""
    ends: dict[str, set[str]] = {}
    for path in paths:
        ends.setdefault(path.rpartition("/")[2], set()).add(path)
    return {
        path: end if len(same) == 1 else _parted(path, same - {path}) for end, same in ends.items() for path in same
    }


def _parted(path: str, others: set[str]) -> str:
    """The first step from the root by which the path differs from the others, and its last."""
    steps = path.split("/")
    for number, step in enumerate(steps[:-1]):
        if all(other.split("/")[: number + 1] != steps[: number + 1] for other in others):
            return f"{step}: {steps[-1]}"
    return steps[-1]


def phase_lane(attempts: Sequence[Attempt], phases: Mapping[str, str]) -> Lane:
    """The phases that followed one another: the outermost subtree, or leaf, that was at work."""
    lane = Lane("phase", "")
    for attempt in attempts:
        name = phases.get(attempt.path, attempt.path.rpartition("/")[2])
        last = lane.bars[-1] if lane.bars else None
        if last is not None and last.title == name:
            lane.bars[-1] = Bar(last.start, max(last.end, attempt.ended), "", name)
        elif attempt.ended > attempt.started:
            lane.bars.append(Bar(attempt.started, attempt.ended, "", name))
    return lane


def marks(record: RunRecord) -> list[Mark]:
    """Every event, and what truly happened by the task's judge, in the order of time."""
    told = [Mark(event.t, kind_of(event), event.node, _words(event)) for event in record.events]
    return sorted([*told, *_truths(record)], key=lambda mark: mark.t)


def _words(event: Event) -> str:
    """An event for a reader: what the rest of the page tells is left out."""
    values = event.values
    if event.event == "failed" and "message" in values:
        passed = f" (passed on from {values['of']})" if values.get("of") else ""
        return f"failed: {values.get('code')}: {values['message']}{passed}"
    if event.event == "planned":
        return f"planned, because {values.get('because')}: {values.get('actions')}"
    if event.event == "end":
        return f"end: {values.get('outcome')}, {'' if values.get('succeeded') else 'not '}as expected"
    if event.event == "begin":
        return "begin"
    told = {name.replace("_", " "): value for name, value in values.items() if name != "why"}
    why = f": {values['why']}" if "why" in values else ""
    return f"{event_words(event.event, told, ' ')}{why}"


def kind_of(event: Event) -> str:
    """The kind of mark that shows an event."""
    if event.event in ("failed", "unintended touch"):
        return "failed"
    if event.event.startswith("fault "):
        return "fault"
    if event.event in ("planned", "no plan"):
        return "plan"
    if event.level in ("warning", "error"):
        return "warning"
    return "look" if LOOKS.search(event.event) else "note"


def _truths(record: RunRecord) -> Iterator[Mark]:
    if record.result is None:
        return
    try:
        for t, text in words_of(record.result.task).measured_moments(record.result.measured):
            yield Mark(float(t), "truth", "", text)
    except Exception:  # another package's code, and a file that anybody may have changed
        return


@dataclass(frozen=True)
class Failure:
    """An attempt that failed: the leaf's cause, the nodes that failed with it, and what the tree did then."""

    attempt: Attempt
    passed_on: tuple[str, ...]  # names from the leaf's parent up
    held_by: str  # path of the node above that did not fail with them; '' if all did
    then: str  # path of the leaf that was tried next; '' if none was


def failures(record: RunRecord, attempts: Sequence[Attempt]) -> list[Failure]:
    """The attempts that failed with a cause, in their order."""
    failed = {(tick.path, tick.t) for tick in record.ticks if tick.status == "FAILURE"}
    nodes = {tick.path for tick in record.ticks}
    ordered = sorted(attempts, key=lambda attempt: attempt.started)
    starts = [attempt.started for attempt in ordered]
    found = []
    for attempt in attempts:
        if attempt.cause is None:
            continue
        above = [path for path in _above(attempt.path) if path in nodes]
        with_it = next((n for n, path in enumerate(above) if (path, attempt.ended) not in failed), len(above))
        later = ordered[bisect_right(starts, attempt.ended - 1e-9) :]
        then = next((one.path for one in later if one is not attempt), "")
        passed = tuple(path.rpartition("/")[2] for path in above[:with_it])
        held = above[with_it] if with_it < len(above) else ""
        found.append(Failure(attempt, passed, held, then))
    return found


@dataclass(frozen=True)
class Repeated:
    """Attempts of a leaf that failed for the same cause: how many, the first one, and when the last one ended."""

    count: int
    first: Attempt
    last: float


def repeated(failed: Sequence[Failure]) -> list[Repeated]:
    """The failures by leaf and cause, in the order of the first of each; what a node only passed on is left out."""
    groups: dict[tuple[str, str], list[Attempt]] = {}
    for attempt in (one.attempt for one in failed):
        if attempt.cause and attempt.cause.node in ("", attempt.path):
            groups.setdefault((attempt.path, attempt.cause.code), []).append(attempt)
    return [Repeated(sum(one.times for one in same), same[0], same[-1].ended) for same in groups.values()]


def _above(path: str) -> Iterator[str]:
    while "/" in path:
        path = path.rpartition("/")[0]
        yield path
