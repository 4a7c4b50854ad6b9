"""Where two recorded runs differ."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from itertools import zip_longest
from typing import Any

from regrasp.app.records.reader import Event, RunRecord, Tick
from regrasp.app.records.result import plain
from regrasp.interfaces.quote import printable

BEGIN_FIELDS = (
    "scenario",
    "case",
    "seed",
    "gravity",
    "cell",
    "tree",
    "inputs",
    "limits",
    "overrides",
    "renderer",
)  # of the `begin` event
RESULT_FIELDS = ("outcome", "succeeded", "cause")
MAX_VALUE_LENGTH = 200  # characters of a value


def beginnings(a: RunRecord, b: RunRecord) -> list[str]:
    """Lines that say what differs at the beginning of the runs: scenario, seed, tree, versions."""
    versions = [run.result.versions if run.result else {} for run in (a, b)]
    found = [line for name in BEGIN_FIELDS for line in _differ(name, a.begin.get(name), b.begin.get(name))]
    if _tree(a) != _tree(b):
        found.append("tree.xml: not the same tree")
    return [printable(line) for line in (*found, *_differ("versions", *versions))]


def _tree(run: RunRecord) -> bytes | None:
    file = run.folder / "tree.xml"
    return file.read_bytes() if file.is_file() else None


def differences(a: RunRecord, b: RunRecord) -> list[str]:
    """Lines that say where the runs differ, [] if they went the same way; wall-clock times do not count."""
    values = [plain(asdict(run.result)) if run.result else {} for run in (a, b)]
    ends = [line for name in RESULT_FIELDS for line in _differ(name, *(value.get(name) for value in values))]
    return [printable(line) for line in (*ends, *_first_tick(a.ticks, b.ticks), *_first_event(_course(a), _course(b)))]


def _differ(name: str, a: Any, b: Any) -> Iterator[str]:
    """A line for each value that differs; mappings are compared key by key."""
    if (isinstance(a, dict) and isinstance(b or {}, dict)) or (isinstance(b, dict) and a is None):
        for key in dict.fromkeys([*(a or {}), *(b or {})]):
            yield from _differ(f"{name}.{key}", (a or {}).get(key), (b or {}).get(key))
    elif a != b:
        yield f"{name}: {_short(a)} | {_short(b)}"


def _short(value: Any) -> str:
    text = "-" if value is None else str(value)
    return text if len(text) <= MAX_VALUE_LENGTH else text[: MAX_VALUE_LENGTH - 3] + "..."


def _first_tick(a: Sequence[Tick], b: Sequence[Tick]) -> Iterator[str]:
    """The first tick in which the runs differ: the deepest node that differs after it, and its status in each run."""
    pair = next(((x, y) for x, y in zip_longest(a, b) if x != y), None)
    if pair is None:
        return
    t = min(tick.t for tick in pair if tick)
    first, second = ({tick.path: tick.status for tick in ticks if tick.t <= t} for ticks in (a, b))
    paths = [path for path in dict.fromkeys([*first, *second]) if first.get(path) != second.get(path)]
    if paths:
        path = max(paths, key=lambda path: path.count("/"))
        yield f"first differing tick at {t:.2f} s: {path}: {first.get(path, '-')} | {second.get(path, '-')}"
    else:  # a node came and went in this tick, or ended again as before
        told = (f"{x.path} {x.status}" if x and x.t == t else "none" for x in pair)
        yield f"first differing tick at {t:.2f} s: " + " | ".join(told)


def _course(run: RunRecord) -> list[Event]:
    return [event for event in run.events if event.event not in ("begin", "end")]


def _first_event(a: Sequence[Event], b: Sequence[Event]) -> Iterator[str]:
    """The first event that differs, with the values that differ."""
    pair = next(((x, y) for x, y in zip_longest(a, b) if x != y), None)
    if pair is None:
        return
    x, y = pair
    if x is None or y is None or (x.node, x.event) != (y.node, y.event):
        yield f"first differing event: {_told(x)} | {_told(y)}"
        return
    yield f"first differing event at {min(x.t, y.t):.2f} s: {x.node or '-'} {x.event}"
    pairs: dict[str, Callable[[Event], Any]] = {"t": lambda event: event.t, "": lambda event: event.values}
    yield from (f"  {line.lstrip('.')}" for name, of in pairs.items() for line in _differ(name, of(x), of(y)))


def _told(event: Event | None) -> str:
    return f"{event.t:.2f} s {event.node or '-'} {event.event}" if event else "none"
