"""Executions of each node in a recorded run, read from its tick log, and their statistics."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

Change = tuple[float, str, str]  # simulated s, path, status: a line of the tick log


@dataclass(frozen=True, slots=True)
class NodeExecution:
    """One execution of a node, in simulated seconds.

    Status INVALID: its parent stopped it; RUNNING: it still ran at the log's end.
    """

    path: str
    started: float
    ended: float
    status: str


def executions(changes: Iterable[Change]) -> list[NodeExecution]:
    """Every execution of every node in the order of their beginning, from the lines of a tick log in their order.

    A node that runs at the end of the log counts as running until the last line.
    """
    made: list[NodeExecution] = []
    running: dict[str, int] = {}  # of a path the index of its execution
    now = 0.0
    for now, path, status in changes:
        if path not in running:
            if status == "INVALID":
                continue  # the reset of a node that had ended
            running[path] = len(made)
            made.append(NodeExecution(path, now, now, "RUNNING"))
        if status != "RUNNING":
            at = running.pop(path)
            made[at] = replace(made[at], ended=now, status=status)
    for at in running.values():
        made[at] = replace(made[at], ended=now)
    return made


@dataclass
class NodeStats:
    """One node's share of a run."""

    visits: int = 0  # executions
    successes: int = 0
    failures: int = 0
    stopped: int = 0  # by its parent, before it ended by itself
    running_seconds: float = 0.0  # simulated
    last: str = "INVALID"  # how its last execution ended

    @property
    def text(self) -> str:
        """For a person: 2 visits, 1 failed, 1 stopped, 3.25 s."""
        if not self.visits:
            return "not visited"
        parts = [f"{self.visits} visit{'' if self.visits == 1 else 's'}"]
        for count, word in ((self.successes, "ok"), (self.failures, "failed"), (self.stopped, "stopped")):
            parts += [f"{count} {word}"] if count else []
        return ", ".join([*parts, f"{self.running_seconds:.2f} s"] if self.running_seconds else parts)


def run_stats(changes: Iterable[Change]) -> dict[str, NodeStats]:
    """The stats of each node by its path, from the same lines; what was never visited is left out."""
    stats: dict[str, NodeStats] = {}
    for one in executions(changes):
        node = stats.setdefault(one.path, NodeStats())
        node.visits += 1
        node.successes += one.status == "SUCCESS"
        node.failures += one.status == "FAILURE"
        node.stopped += one.status == "INVALID"
        node.running_seconds += one.ended - one.started
        node.last = one.status
    return stats
