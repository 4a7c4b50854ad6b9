"""What a recorded run did at each node, counted from its tick log."""

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass
class NodeStats:
    """One node's share of a run.

    The log holds changes of status only, so a node that ends in the same way at tick after tick counts as one visit.
    """

    visits: int = 0  # times that it began
    successes: int = 0
    failures: int = 0
    stopped: int = 0  # from above, before it ended by itself
    running_seconds: float = 0.0  # simulated
    last: str = "INVALID"  # status at the end of the log

    @property
    def text(self) -> str:
        """For a person: 2 visits, 1 failed, 1 stopped, 3.25 s."""
        if not self.visits:
            return "not visited"
        parts = [f"{self.visits} visit{'' if self.visits == 1 else 's'}"]
        for count, word in ((self.successes, "ok"), (self.failures, "failed"), (self.stopped, "stopped")):
            parts += [f"{count} {word}"] if count else []
        return ", ".join([*parts, f"{self.running_seconds:.2f} s"] if self.running_seconds else parts)


def run_stats(ticks: Iterable[tuple[float, str, str]]) -> dict[str, NodeStats]:
    """The stats of each node by its path, from the changes of status in their order: simulated s, path, status.

    A node that still runs has run until the last line.
    """
    stats: dict[str, NodeStats] = {}
    running_since: dict[str, float] = {}
    now = 0.0
    for now, path, status in ticks:
        node = stats.setdefault(path, NodeStats())
        if path in running_since:
            node.running_seconds += now - running_since.pop(path)
            node.stopped += status == "INVALID"
        elif status != "INVALID":
            node.visits += 1
        if status == "RUNNING":
            running_since[path] = now
        node.successes += status == "SUCCESS"
        node.failures += status == "FAILURE"
        node.last = status
    for path, since in running_since.items():
        stats[path].running_seconds += now - since
    return stats
