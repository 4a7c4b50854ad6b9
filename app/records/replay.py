"""Replays a record change by change: the status of every node after each, as lines or for a screen."""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, field

from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.files.resources import read_text
from regrasp.app.records.reader import Event, RunRecord, Tick
from regrasp.app.records.timeline import event_text
from regrasp.interfaces.quote import nearest, printable, quoted
from regrasp.trees.element import TreeSyntaxError
from regrasp.trees.graph import Node, read_graph

TIME_TOLERANCE = 1e-9  # s: a typed second differs from a recorded one by rounding


@dataclass
class Change:
    """A tick in which something changed: the lines of ticks.jsonl and the events of its second `t`, in their order."""

    t: float
    nodes: list[Tick] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)


@dataclass(frozen=True)
class TreeRow:
    """A node: its path, its element name in the tree file, and its depth (0 for the root)."""

    path: str
    type: str
    depth: int


class Replay:
    """The changes of a record up to second `end`, and the rows of its tree in tree order.

    A tick in which nodes only end as they did before is left out: a guard that is ticked every time would fill all.
    """

    def __init__(self, record: RunRecord, end: float = math.inf) -> None:
        """Raises `Findings` for a tree.xml that cannot be read, and for a record in which nothing happened."""
        changes: dict[float, Change] = {}
        last: dict[str, str] = {}
        changed = {event.t for event in record.events}
        for tick in record.ticks:
            changes.setdefault(tick.t, Change(tick.t)).nodes.append(tick)
            if last.get(tick.path) != tick.status:
                changed.add(tick.t)
            last[tick.path] = tick.status
        for event in record.events:
            changes.setdefault(event.t, Change(event.t)).events.append(event)
        if not changes:
            raise Findings(
                [Finding(shown(record.folder), 0, "nothing happened in this run; there is nothing to replay")]
            )
        last_shown = max(end, min(changed)) + TIME_TOLERANCE
        self.changes = [changes[t] for t in sorted(changed) if t <= last_shown]
        self.rows = _rows(record)
        self._times = [change.t for change in self.changes]
        self._history: dict[str, tuple[list[int], list[str]]] = {}
        for i, change in enumerate(self.changes):
            for tick in change.nodes:
                at, statuses = self._history.setdefault(tick.path, ([], []))
                at.append(i)
                statuses.append(tick.status)

    def status(self, path: str, index: int) -> str:
        """A node's status after the change of that index."""
        at, statuses = self._history.get(path, ([], []))
        last = bisect_right(at, index)
        return statuses[last - 1] if last else "INVALID"

    def at(self, seconds: float) -> int:
        """Index of the last change at or before this second, 0 if there is none."""
        return max(0, bisect_right(self._times, seconds + TIME_TOLERANCE) - 1)

    def known(self, part: str) -> bool:
        """Whether a node of the tree, or of an event, has `part` in its path."""
        return any(part in path for path in self._paths())

    def check(self, begin: float, part: str) -> None:
        """Raises `Findings` if nothing is left to show from second `begin`, or of paths that contain `part`."""
        found = []
        if begin > self._times[-1] + TIME_TOLERANCE:
            wrong = f"{begin:g} s is after the last change, at {self._times[-1]:.2f} s; name an earlier second"
            found.append(Finding("--from", 0, wrong))
        if not self.known(part):
            names = {path.rsplit("/", 1)[-1] for path in self._paths()}
            found.append(Finding("--filter", 0, f"no node has {quoted(part)} in its path; {nearest(part, names)}"))
        if found:
            raise Findings(found)

    def _paths(self) -> list[str]:
        events = {event.node for change in self.changes for event in change.events if event.node}
        return [*(row.path for row in self.rows), *events]

    def next_failure(self, index: int, part: str = "") -> int | None:
        """Index of the next change in which a node fails whose path contains `part`; None if there is none."""
        later = range(index + 1, len(self.changes))
        return next(
            (i for i in later if any(t.status == "FAILURE" and part in t.path for t in self.changes[i].nodes)), None
        )

    def lines(self, begin: float, part: str) -> Iterator[str]:
        """A line for each change and event from second `begin` of the nodes whose path contains `part`."""
        for change in self.changes[bisect_left(self._times, begin - TIME_TOLERANCE) :]:
            yield from (
                printable(f"{change.t:8.2f}  {tick.path}  {tick.status}") for tick in change.nodes if part in tick.path
            )
            yield from (
                printable(f"{change.t:8.2f}  {event.node or '-'}  {event_text(event)}")
                for event in change.events
                if part in event.node
            )


def check_span(begin: float | None, end: float | None) -> None:
    """Raises `Findings` for seconds that are negative or not finite, and for an end before the beginning."""
    found = [
        Finding(option, 0, f"{seconds:g} is no second of a run; write a number such as 8.5")
        for option, seconds in (("--from", begin), ("--to", end))
        if seconds is not None and not 0 <= seconds < math.inf
    ]
    if not found and begin is not None and end is not None and begin > end:
        found.append(Finding("--to", 0, f"{end:g} s is before --from, {begin:g} s; name a later second"))
    if found:
        raise Findings(found)


def _rows(record: RunRecord) -> list[TreeRow]:
    """The nodes of the record's copy of the tree, then other nodes that the ticks name (all, if there is no copy)."""
    file = record.folder / "tree.xml"
    rows: list[TreeRow] = []
    if file.exists():
        read_text(file)  # its findings are ours
        try:
            rows = list(_below(read_graph(file, {}), 0))
        except TreeSyntaxError as error:
            raise Findings([Finding(shown(file), error.line, str(error))]) from None
        except (OSError, ValueError) as error:
            raise Findings([Finding(shown(file), 0, str(error))]) from None
    known = {row.path for row in rows}
    others = dict.fromkeys(tick.path for tick in record.ticks if tick.path not in known)
    return rows + [TreeRow(path, "", path.count("/")) for path in others]


def _below(node: Node, depth: int) -> Iterator[TreeRow]:
    inside = depth
    if node.kind != "subtree":  # it has no node of its own in a run
        yield TreeRow(node.path, node.type, depth)
        inside += 1
    for child in node.children:
        yield from _below(child, inside)
