"""A record tick by tick: what every node was at each, as lines or for a screen."""

from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, field

from app.findings import Finding, Findings, printable, shown
from app.record_reader import Event, RunRecord, Tick
from app.resources import read_text
from app.timeline import event_text
from trees.element import TreeSyntaxError
from trees.graph import Node, read_graph


@dataclass
class Frame:
    """One moment at which something happened: the nodes' changes and the events, in their order."""

    t: float
    changes: list[Tick] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)


@dataclass(frozen=True)
class Row:
    """A node by its path, its type as the file writes it, and how deep it stands (the root at 0)."""

    path: str
    type: str
    depth: int


class Replay:
    """The frames of a record, and the rows of its tree in tree order."""

    def __init__(self, record: RunRecord) -> None:
        """Raises `Findings` for a tree.xml that cannot be read, and for a record in which nothing happened."""
        frames: dict[float, Frame] = {}
        for tick in record.ticks:
            frames.setdefault(tick.t, Frame(tick.t)).changes.append(tick)
        for event in record.events:
            frames.setdefault(event.t, Frame(event.t)).events.append(event)
        if not frames:
            raise Findings(
                [Finding(shown(record.folder), 1, "nothing happened in this run; there is nothing to replay")]
            )
        self.frames = [frames[t] for t in sorted(frames)]
        self.rows = _rows(record)
        self._times = [frame.t for frame in self.frames]
        self._history: dict[str, tuple[list[int], list[str]]] = {}
        for i, frame in enumerate(self.frames):
            for tick in frame.changes:
                at, statuses = self._history.setdefault(tick.path, ([], []))
                at.append(i)
                statuses.append(tick.status)

    def status(self, path: str, index: int) -> str:
        """A node's status after the frame of that index."""
        at, statuses = self._history.get(path, ([], []))
        last = bisect_right(at, index)
        return statuses[last - 1] if last else "INVALID"

    def at(self, seconds: float) -> int:
        """Index of the last frame at or before that second, the first one if there is none."""
        return max(0, bisect_right(self._times, seconds + 1e-9) - 1)

    def next_failure(self, index: int, part: str = "") -> int | None:
        """Index of the next frame in which a node fails whose path has `part` in it."""
        later = range(index + 1, len(self.frames))
        return next(
            (i for i in later if any(t.status == "FAILURE" and part in t.path for t in self.frames[i].changes)), None
        )

    def lines(self, begin: float, end: float, part: str) -> Iterator[str]:
        """Changes and events from second `begin` to `end` of the nodes whose path has `part` in it, a line each."""
        for frame in self.frames[bisect_left(self._times, begin - 1e-9) : bisect_right(self._times, end + 1e-9)]:
            yield from (
                printable(f"{frame.t:8.2f}  {tick.path}  {tick.status}") for tick in frame.changes if part in tick.path
            )
            yield from (
                printable(f"{frame.t:8.2f}  {event.node or '-'}  {event_text(event)}")
                for event in frame.events
                if part in event.node
            )


def _rows(record: RunRecord) -> list[Row]:
    """The tree's nodes: of its copy in the record, and what else the ticks name (all, where there is no copy)."""
    file = record.folder / "tree.xml"
    rows: list[Row] = []
    if file.exists():
        read_text(file)  # its findings are ours
        try:
            rows = list(_below(read_graph(file, {}), 0))
        except TreeSyntaxError as error:
            raise Findings([Finding(shown(file), error.line, str(error))]) from None
        except (OSError, ValueError) as error:
            raise Findings([Finding(shown(file), 1, str(error))]) from None
    known = {row.path for row in rows}
    others = dict.fromkeys(tick.path for tick in record.ticks if tick.path not in known)
    return rows + [Row(path, "", path.count("/")) for path in others]


def _below(node: Node, depth: int) -> Iterator[Row]:
    inside = depth
    if node.kind != "subtree":  # it has no node of its own in a run
        yield Row(node.path, node.type, depth)
        inside += 1
    for child in node.children:
        yield from _below(child, inside)
