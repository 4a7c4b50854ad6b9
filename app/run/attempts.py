"""The attempts of a run: every execution of a leaf and how it ended, and the nodes that decided the outcome."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import py_trees
from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Selector
from py_trees.decorators import Decorator, Retry

from regrasp.app.records.result import Attempt, Link, NodeStatus
from regrasp.interfaces.cause import Cause
from regrasp.trees import in_tree_order, node_paths


@dataclass(frozen=True)
class _Failure:
    """A node's latest failure: its tick, its link in the chain, its cause, and the failure below that decided it."""

    tick: int
    link: Link
    cause: Cause | None
    passed_on: bool  # whether the cause is another leaf's, as a safe stop passes on
    below: "_Failure | None"

    def down(self) -> Iterator["_Failure"]:
        """This failure and those below it, down to the leaf."""
        failure: _Failure | None = self
        while failure is not None:
            yield failure
            failure = failure.below


class Attempts(py_trees.visitors.VisitorBase):
    """A visitor of a tree; `made` are the attempts so far, in the order of their beginning.

    The attempts must be noted tick by tick: a node with memory resets what failed before at the next tick. `causes`
    gives those of the leaves that have failed so far, the latest last. `types` holds the tree file's element name of
    each node by path; a node without one is named by its class. After a stop outside a tick call `finalise()`.
    """

    def __init__(
        self,
        root: Behaviour,
        causes: Callable[[], Sequence[Cause]],
        now: Callable[[], float],
        types: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(full=False)
        self.made: list[Attempt] = []
        self._root, self._causes, self._now = root, causes, now
        self._paths = node_paths(root)
        self._types = types or {}
        self._leaves = [node for node in in_tree_order(root) if not node.children]
        self._open: set[int] = set()  # ids of leaves that run
        self._latest: dict[int, tuple[int, int]] = {}  # of a leaf: index of its last attempt, tick of its last visit
        self._failures: dict[int, _Failure] = {}
        self._told = 0  # how many causes belong to an attempt already
        self._tick = 0

    def initialise(self) -> None:
        """Before a tick."""
        self._tick += 1

    def run(self, behaviour: Behaviour) -> None:
        """At a node's visit, after its children's visits."""
        failed = behaviour.status is Status.FAILURE
        if behaviour.children:
            if failed:
                self._failures[id(behaviour)] = self._failure(behaviour)
            return
        cause, passed_on = self._new_cause() if failed else (None, False)
        self._visit_leaf(behaviour, cause)
        if failed:
            why = f"{cause.code}: {cause.message}" if cause else "failed, and names no cause"
            self._failures[id(behaviour)] = _Failure(self._tick, self._link(behaviour, why), cause, passed_on, None)

    def finalise(self) -> None:
        """After a tick, or after a stop outside one: end the attempts of leaves that were stopped without a visit."""
        for leaf in self._leaves:
            if id(leaf) in self._open and leaf.status is not Status.RUNNING:
                self._close(leaf, Status.INVALID)

    def raised(self, leaf: Behaviour, cause: Cause) -> None:
        """End a leaf's attempt with this cause: it raised an exception, and so is not visited."""
        if id(leaf) not in self._open:
            self._begin(leaf)
        self._close(leaf, Status.INVALID, cause)

    def cause(self) -> Cause | None:
        """The cause of the leaf that decided the root's failure; None if it gave none."""
        failure = self._failures.get(id(self._root))
        return [*failure.down()][-1].cause if failure else None

    def failed_chain(self) -> tuple[Link, ...] | None:
        """The chain from the root down to the leaf whose failure decided; None while the root has not failed."""
        failure = self._failures.get(id(self._root))
        return tuple(f.link for f in failure.down()) if failure else None

    def chain_to(self, node: Behaviour | None, verb: str, why: str) -> tuple[Link, ...] | None:
        """The chain from the root down to the node at which a run was cut short.

        Each link above the node says "child x `verb`", the node's own link says `why`.
        """
        links: list[Link] = []
        while node is not None:
            links.insert(0, self._link(node, why))
            node, why = node.parent, f"child {_own_name(node)} {verb}"
        return tuple(links) or None

    def _link(self, node: Behaviour, why: str) -> Link:
        path = self._paths[node.id]
        return Link(path, self._types.get(path, type(node).__name__), self._seconds(), why)

    def _seconds(self) -> float:
        return round(self._now(), 6)

    def _new_cause(self) -> tuple[Cause | None, bool]:
        """The cause of the failed leaf that is visited now, and whether the leaf passes on an earlier one.

        It is the last one that came since the visit of the failed leaf before.
        """
        causes = self._causes()
        old, new, self._told = causes[: self._told], causes[self._told :], len(causes)
        return (new[-1], any(cause is new[-1] for cause in old)) if new else (None, False)

    def _visit_leaf(self, leaf: Behaviour, cause: Cause | None) -> None:
        if id(leaf) not in self._open and not self._repeats(leaf, cause):
            self._begin(leaf)
        if leaf.status is not Status.RUNNING:
            self._close(leaf, leaf.status, cause)

    def _begin(self, leaf: Behaviour) -> None:
        self._open.add(id(leaf))
        self._latest[id(leaf)] = (len(self.made), self._tick)
        self.made.append(Attempt(self._paths[leaf.id], self._seconds(), self._seconds(), "RUNNING"))

    def _close(self, leaf: Behaviour, status: Status, cause: Cause | None = None) -> None:
        index, _ = self._latest[id(leaf)]
        value: NodeStatus = status.value
        self.made[index] = replace(self.made[index], ended=self._seconds(), status=value, cause=cause)
        self._latest[id(leaf)] = (index, self._tick)
        self._open.discard(id(leaf))

    def _repeats(self, leaf: Behaviour, cause: Cause | None) -> bool:
        """Whether the leaf ended within this tick exactly as it did in the tick before: it is then the same attempt.

        In the next round of a loop it is another attempt.
        """
        index, tick = self._latest.get(id(leaf), (-1, -1))
        if leaf.status is Status.RUNNING or tick != self._tick - 1 or _in_a_new_round(leaf):
            return False
        last = self.made[index]
        at_once = last.times > 1 or last.started == last.ended
        if not at_once or (last.status, last.cause) != (leaf.status.value, cause):
            return False
        self.made[index] = replace(last, times=last.times + 1)
        return True

    def _failure(self, node: Behaviour) -> _Failure:
        """The failure of a node with children."""
        child = self._deciding_child(node)
        if child is not None:
            return _Failure(self._tick, self._link(node, _why(node, child)), None, False, self._failures[id(child)])
        cause, _ = self._new_cause()  # such as a time limit's
        why = f"{cause.code}: {cause.message}" if cause else _why(node, child)
        return _Failure(self._tick, self._link(node, why), cause, False, None)

    def _deciding_child(self, node: Behaviour) -> Behaviour | None:
        """The child whose failure made the node fail; None if no child's did.

        Of a Fallback it is the last child with a cause of its own: a safe stop after a failed mission passes on the
        mission's cause.
        """
        failures = {id(child): f for child in node.children if (f := self._failures.get(id(child)))}
        if isinstance(node, Selector):  # all its children have failed; with memory, some in earlier ticks
            leaves = {id(child): [*failures[id(child)].down()][-1] for child in node.children}
            own = [c for c in node.children if leaves[id(c)].cause is not None and not leaves[id(c)].passed_on]
            return (own or node.children)[-1]
        return next((c for c in node.children if id(c) in failures and failures[id(c)].tick == self._tick), None)


def _why(node: Behaviour, child: Behaviour | None) -> str:
    """Why a node with children failed, in words; `child` decided it."""
    if isinstance(node, Selector):
        every = {1: "its only child", 2: "both children"}
        return f"{every.get(len(node.children), f'all {len(node.children)} children')} failed"
    if isinstance(node, Retry):
        return f"{node.failures} of {node.num_failures} tries failed"
    if isinstance(node, Decorator):
        return (
            "its child failed" if child else f"its child ended {node.decorated.status.value}, which it makes a failure"
        )
    if child is None:
        return "failed by itself"
    return f"child {_own_name(child)} failed ({node.children.index(child) + 1} of {len(node.children)})"


def _in_a_new_round(leaf: Behaviour) -> bool:
    """Whether a decorator above the leaf, such as Retry, has begun a new round in this tick.

    At a node's visit the nodes above it still have the status of the tick before: RUNNING for a loop that goes on.
    """
    node = leaf
    while node.parent is not None and node.parent.status is not Status.RUNNING:
        node = node.parent
    return node is not leaf and isinstance(node.parent, Decorator)


def _own_name(node: Behaviour) -> str:
    return str(node.name.rsplit(".", 1)[-1])
