"""What each node of a tree did at each tick, as text to read and to compare in tests."""

from collections.abc import Collection
from uuid import UUID

import py_trees
from py_trees.common import Status

from regrasp.trees.paths import find_path, in_tree_order, node_paths

IDLE, STOPPED = ".", "X"
_LETTERS = {Status.RUNNING: "R", Status.SUCCESS: "S", Status.FAILURE: "F", Status.INVALID: IDLE}


class TickTable(py_trees.visitors.VisitorBase):
    """A visitor that keeps one letter per tick for each node.

    R running, S success, F failure, X stopped by its parent while it ran, a dot when it was not visited.
    """

    def __init__(self, root: py_trees.behaviour.Behaviour) -> None:
        super().__init__(full=False)
        paths = node_paths(root)
        self._nodes = {paths[node.id]: node for node in in_tree_order(root)}
        self._visited: dict[UUID, Status] = {}
        self._running = dict.fromkeys(self._nodes, False)  # when the tick began
        self._rows: dict[str, list[str]] = {path: [] for path in self._nodes}

    def initialise(self) -> None:
        """Before a tick."""
        self._visited.clear()
        self._running = {path: node.status is Status.RUNNING for path, node in self._nodes.items()}

    def run(self, behaviour: py_trees.behaviour.Behaviour) -> None:
        """At a node's visit."""
        self._visited[behaviour.id] = behaviour.status

    def finalise(self) -> None:
        """After a tick: a letter for each node."""
        for path, node in self._nodes.items():
            seen = self._visited.get(node.id)
            ran = self._running[path] if seen is None else seen is Status.RUNNING
            stopped = ran and node.status is Status.INVALID
            self._rows[path].append(STOPPED if stopped else IDLE if seen is None else _LETTERS[seen])

    def stopped(self) -> None:
        """After a stop outside a tick: it shows in the last tick."""
        for path, node in self._nodes.items():
            if self._rows[path][-1:] == ["R"] and node.status is Status.INVALID:
                self._rows[path][-1] = STOPPED

    def text(self, *nodes: str) -> str:
        """A line a node: the root and the leaves that did anything, or the nodes named by path or its last parts.

        Raises:
            ValueError: there is no such node.
        """
        root, *below = self._nodes
        rows = {path: "".join(row) for path, row in self._rows.items()}
        busy = [path for path in below if not self._nodes[path].children and rows[path].strip(IDLE)]
        chosen = [find_path(node, self._nodes) for node in nodes] or [root, *busy]
        lines = {"tick": _ruler(len(rows[root]))}
        lines |= {_label(path, self._nodes): rows[path] for path in chosen}
        width = max(map(len, lines))
        return "\n".join(f"{label:<{width}}  {row}" for label, row in lines.items())


def _label(path: str, paths: Collection[str]) -> str:
    """The last parts of a path that no other has."""
    parts = path.split("/")
    tails = ("/".join(parts[-n:]) for n in range(1, len(parts) + 1))
    return next(tail for tail in tails if tail == path or sum(f"/{p}".endswith(f"/{tail}") for p in paths) == 1)


def _ruler(ticks: int) -> str:
    """The numbers 1, 5, 10, 15, ... with their first digit above their tick."""
    marks = [1, *range(5, ticks + 1, 5)][: max(ticks, 0)]
    text = ""
    for mark in marks:
        text = f"{text:<{mark - 1}}{mark}"
    return text
