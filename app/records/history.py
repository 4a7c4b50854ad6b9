"""The attempts of a recorded run: those of its result or, without a result, as its ticks and events show them."""

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import replace

from regrasp.app.records.reader import Event, RunRecord
from regrasp.app.records.result import Attempt
from regrasp.interfaces.cause import Cause
from regrasp.trees import NodeExecution, executions


class NodeHistory:
    """When each node of a record was executed, and which nodes are below which."""

    def __init__(self, made: Sequence[NodeExecution]) -> None:
        self._starts: dict[str, list[float]] = {}
        self._below: dict[str, set[str]] = {}
        for one in made:
            self._starts.setdefault(one.path, []).append(one.started)
            names = one.path.split("/")
            for depth in range(1, len(names)):
                self._below.setdefault("/".join(names[:depth]), set()).add(names[depth])

    def is_leaf(self, path: str) -> bool:
        """Whether no node is below this one."""
        return path not in self._below

    def new_round(self, path: str, before: float, after: float) -> tuple[str, int] | None:
        """The topmost node above `path` that a loop such as Retry restarted between two seconds, and which round it is.

        A loop has one child, which ends while the loop goes on. A guard that is ticked every time is no new round.
        """
        names = path.split("/")
        loop = names[0]
        for depth in range(2, len(names)):
            node = "/".join(names[:depth])
            if node not in self._starts:
                continue  # a subtree's name
            if self._begun(node, before) != self._begun(node, after):
                since = self._starts[loop][self._begun(loop, after) - 1] if self._begun(loop, after) else 0.0
                number = self._begun(node, after) - bisect_left(self._starts[node], since)
                return (node, number) if number > 1 and len(self._below[loop]) == 1 else None
            loop = node
        return None

    def _begun(self, path: str, seconds: float) -> int:
        """How many executions of the node had begun by this second."""
        return bisect_right(self._starts.get(path, []), seconds)


def node_history(record: RunRecord) -> NodeHistory:
    """The node history of a record."""
    return NodeHistory(_executions(record))


def attempts(record: RunRecord) -> Sequence[Attempt]:
    """The attempts of the record's leaves, in the order of their beginning; RUNNING: at work when the record ends."""
    if record.result:
        return record.result.attempts
    told = attempts_from_ticks(_executions(record), record.events)
    return [replace(one, ended=record.end) if one.status == "RUNNING" else one for one in told]


def attempts_from_ticks(made: Sequence[NodeExecution], events: Iterable[Event]) -> list[Attempt]:
    """The attempts that the result of a run with these executions and events would have (see `Attempts`)."""
    known = NodeHistory(made)
    ticks = {t: number for number, t in enumerate(sorted({t for one in made for t in (one.started, one.ended)}))}
    causes = {(event.node, event.t): cause for event in events if (cause := _cause(event))}
    told: list[Attempt] = []
    latest: dict[str, int] = {}
    for one in made:
        if not known.is_leaf(one.path):
            continue
        attempt = Attempt(one.path, one.started, one.ended, one.status, causes.get((one.path, one.ended)))  # type: ignore[arg-type]
        last = told[latest[one.path]] if one.path in latest else None
        if (
            last is not None
            and _alike(last, attempt)
            and ticks[one.ended] == ticks[last.ended] + 1
            and known.new_round(one.path, last.ended, one.started) is None
        ):
            told[latest[one.path]] = replace(last, ended=one.ended, times=last.times + 1)
        else:
            latest[one.path] = len(told)
            told.append(attempt)
    return told


def _alike(last: Attempt, now: Attempt) -> bool:
    """Whether both ended in the tick in which they began, in the same way."""
    at_once = (last.times > 1 or last.started == last.ended) and now.started == now.ended
    return at_once and now.status in ("SUCCESS", "FAILURE") and (last.status, last.cause) == (now.status, now.cause)


def _executions(record: RunRecord) -> list[NodeExecution]:
    return executions((tick.t, tick.path, tick.status) for tick in record.ticks)


def _cause(event: Event) -> Cause | None:
    """The cause in a `failed` event; None for other events."""
    code, message = event.values.get("code"), event.values.get("message")
    if event.event != "failed" or not isinstance(code, str) or not isinstance(message, str):
        return None
    return Cause(code, message, str(event.values.get("of", event.node)))
