"""The tick log: a JSON line for each change of a node's status, and for each end, even if it is like the last one."""

import json
from collections.abc import Callable, Iterator
from typing import TextIO

import py_trees
from py_trees.common import Status

from regrasp.interfaces.wall_time import counts_as
from regrasp.trees import in_tree_order, node_paths


class TickLog(py_trees.visitors.VisitorBase):
    """Writes {"t": simulated s, "path": "root/carry/move", "status": "RUNNING"} for every status that a tick changed.

    A node that ends again as it ended before, such as a guard that is ticked every time, has a line for each end: so
    executions can be counted.

    Add it to a `BehaviourTree` as a visitor. The lines of one tick are in tree order. A node's status is read when it
    is visited, and again after the tick: a node that is stopped later in the tick (preempted, or its Parallel ended)
    becomes INVALID without another visit. After `root.stop(...)` outside a tick call `finalise()`.
    """

    def __init__(self, root: py_trees.behaviour.Behaviour, stream: TextIO, now: Callable[[], float]) -> None:
        super().__init__(full=False)
        paths = node_paths(root)
        self._stream = stream
        self._now = now
        self._nodes = [(node, json.dumps(paths[node.id])) for node in in_tree_order(root)]
        self._last = [node.status for node, _ in self._nodes]
        self._visited: dict[int, Status] = {}

    def initialise(self) -> None:
        """Before a tick."""
        self._visited.clear()

    def run(self, behaviour: py_trees.behaviour.Behaviour) -> None:
        """At a node's visit: note its status, which may have changed when the tick ends."""
        self._visited[id(behaviour)] = behaviour.status

    @counts_as("record")
    def finalise(self) -> None:
        """After a tick, or after a stop outside one: write what changed, and flush."""
        stamp = json.dumps(round(self._now(), 6))
        lines = []
        for i, (node, path) in enumerate(self._nodes):
            seen = self._visited.get(id(node))
            statuses = [] if seen is None or seen is self._last[i] is Status.RUNNING else [seen]
            if node.status is not (self._last[i] if seen is None else seen):
                statuses.append(node.status)
            lines += [f'{{"t": {stamp}, "path": {path}, "status": "{status.value}"}}\n' for status in statuses]
            self._last[i] = node.status
        self._visited.clear()
        if lines:
            self._stream.write("".join(lines))
            self._stream.flush()


def note_leaf_at_work(tree: py_trees.trees.BehaviourTree, note: Callable[[str], None]) -> None:
    """Have `note` called with a leaf's path before each of its ticks, and with "" after each tick of the tree.

    A visitor would not do: py_trees calls visitors after a node's tick, so never for a leaf that hangs.
    """
    paths = node_paths(tree.root)
    for node in in_tree_order(tree.root):
        if not node.children:
            node.tick = _noting(node.tick, paths[node.id], note)
    tree.add_post_tick_handler(lambda _tree: note(""))


def _noting(
    tick: Callable[[], Iterator[py_trees.behaviour.Behaviour]], path: str, note: Callable[[str], None]
) -> Callable[[], Iterator[py_trees.behaviour.Behaviour]]:
    def noted() -> Iterator[py_trees.behaviour.Behaviour]:
        note(path)
        yield from tick()

    return noted


def running_leaf(root: py_trees.behaviour.Behaviour) -> py_trees.behaviour.Behaviour | None:
    """The deepest RUNNING node; None if no node is RUNNING.

    Of the RUNNING children of a Parallel it is the last one: monitors come first.
    """
    node, deepest = root if root.status is Status.RUNNING else None, None
    while node is not None:
        deepest = node
        node = next((child for child in reversed(node.children) if child.status is Status.RUNNING), None)
    return deepest


def active_leaf(root: py_trees.behaviour.Behaviour) -> str:
    """The name, without namespaces, of the `running_leaf`; '' if there is none."""
    leaf = running_leaf(root)
    return "" if leaf is None else str(leaf.name.rsplit(".", 1)[-1])
