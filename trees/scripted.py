"""Tree files with scripted leaves: tests a tree's logic tick by tick on the simulated clock, without a world.

    tree = ScriptedTree(Path("trees/recovery.xml"), {"Carry": "3 failure, 2 success"})
    tree.run()
    print(tree.table())

A leaf's script says, for each time it is entered, at which of its ticks it ends and how. With "3 failure, 2 success" it
fails at its third tick; when it is entered again, and every time after that, it succeeds at its second tick. "success"
is "1 success", and "running" never ends.
"""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar, NamedTuple, cast

import py_trees
from py_trees.common import Status
from py_trees.composites import Composite
from py_trees.decorators import Decorator
from py_trees.ports import BehaviourWithPorts, PortInformation

from regrasp.behaviors.keys import USES, declared
from regrasp.interfaces.devices import TICK
from regrasp.trees.element import TreeSyntaxError, read_elements
from regrasp.trees.leaf_sets import installed_leaves
from regrasp.trees.load import load_tree
from regrasp.trees.paths import find_path, in_tree_order, node_paths
from regrasp.trees.task_networks import networks_named_in
from regrasp.trees.tick_table import TickTable
from regrasp.trees.vocabulary import ANY_STATUS, BUILT_IN

MAX_TICKS = 10_000  # a tree that has not ended by then never will
_ACT = re.compile(r"(?:([1-9]\d{0,5})\s+)?(success|failure|running)")


class Act(NamedTuple):
    """What a leaf does when it is entered once: RUNNING until its tick number `ticks`, which has this status."""

    ticks: int
    status: Status


def parse_script(text: str) -> tuple[Act, ...]:
    """The acts of "3 failure, 2 success".

    Raises:
        ValueError: it is no such text.
    """
    acts = []
    for part in text.split(","):
        match = _ACT.fullmatch(part.strip())
        if match is None:
            raise ValueError(f"{part.strip()!r} is no act; write such as '3 failure', 'success' or 'running'")
        acts.append(Act(int(match[1] or 1), Status[match[2].upper()]))
    return tuple(acts)


class ScriptedLeaf(BehaviourWithPorts):
    """A leaf that does what its acts say; the last one is repeated."""

    RETURNS: ClassVar[frozenset[Status]] = ANY_STATUS  # as the real leaf's
    acts: tuple[Act, ...]
    entered = 0  # times
    stopped = 0  # times, from above while it was RUNNING

    def initialise(self) -> None:
        """Begin the next act."""
        self.entered += 1
        self._ticks = 0

    def update(self) -> Status:
        """See the class."""
        self._ticks += 1
        act = self.acts[min(self.entered, len(self.acts)) - 1]
        return act.status if self._ticks >= act.ticks else Status.RUNNING

    def terminate(self, new_status: Status) -> None:
        """Count the stops."""
        self.stopped += self.status is Status.RUNNING and new_status is Status.INVALID


def stand_ins(leaves: Mapping[str, Any]) -> dict[str, type]:
    """A scripted class for each leaf class, with the same ports, declared keys and statuses: the check finds the same.

    Decorators and composites are the tree's logic and stay what they are.
    """
    return {tag: leaf if issubclass(leaf, (Decorator, Composite)) else _of(tag, leaf) for tag, leaf in leaves.items()}


def _installed(path: Path) -> Mapping[str, type]:
    try:
        return installed_leaves(read_elements(path))
    except (OSError, TreeSyntaxError):
        return {}  # findings of the tree's check


def leaves_named_in(path: Path) -> dict[str, type]:
    """Scripted classes for the leaves of a tree file whose own classes are not available; their ports take any value.

    Raises:
        OSError: the file cannot be read.
        TreeSyntaxError: it is not well-formed.
    """
    ports: dict[str, set[str]] = {}
    for element in read_elements(path).walk():
        if not element.children and element.tag not in (*BUILT_IN, "SubTree", "BehaviorTree", "root"):
            ports.setdefault(element.tag, set()).update(element.attributes.keys() - {"name"})
    anything = PortInformation(data_type=str, required=False)
    return {tag: _stand_in(tag, dict.fromkeys(sorted(names), anything), {}) for tag, names in ports.items()}


def _of(tag: str, leaf: Any) -> type[ScriptedLeaf]:
    scripted = _stand_in(tag, leaf.input_ports(), leaf.output_ports(), getattr(leaf, "RETURNS", ANY_STATUS))
    for use in USES:
        setattr(scripted, use, declared(leaf, use))
    return scripted


def _stand_in(
    tag: str, inputs: Mapping[str, Any], outputs: Mapping[str, Any], returns: frozenset[Status] = ANY_STATUS
) -> type[ScriptedLeaf]:
    class StandIn(ScriptedLeaf, register=False):  # type: ignore[call-arg]
        INPUT_PORTS: ClassVar[Any] = inputs
        OUTPUT_PORTS: ClassVar[Any] = outputs
        RETURNS: ClassVar[frozenset[Status]] = returns

    StandIn.__name__ = tag
    return StandIn


def _checked(path: str, acts: tuple[Act, ...], returns: frozenset[Status]) -> tuple[Act, ...]:
    """The acts. Raises ValueError where a leaf that returns these statuses cannot do them."""
    runs = {Status.RUNNING for act in acts if act.ticks > 1}
    if never := ({act.status for act in acts} | runs) - returns:
        raise ValueError(f"{path} never is {_listed(never)}; it is {_listed(returns)}")
    return acts


def _able(act: Act, returns: frozenset[Status]) -> Act:
    """The act, adapted to a leaf that returns these statuses."""
    status = act.status if act.status in returns else Status.RUNNING
    if Status.RUNNING in returns:
        return Act(act.ticks, status)
    return Act(1, status if status in returns else min(returns, key=str))


def _nothing(*_: object, **__: object) -> None:
    return None


def _listed(statuses: Iterable[Status]) -> str:
    return ", ".join(sorted(status.value for status in statuses))


class ScriptedTree:
    """A tree file with scripted leaves; it is ticked every `TICK` simulated seconds, from 0.

    `script` maps leaves, by tag, by tree path or by the path's last parts ("bring/carry"), to their scripts; a path
    goes before a tag. The other leaves follow the script `default` as far as they can: a leaf that never ends in its
    status stays RUNNING, one that is never RUNNING ends at once. `leaves` are the real classes, whose ports and
    statuses the scripted leaves take over, by default those that are installed; `inputs` are those of `load_tree`.
    Two trees at a time share the blackboard.

    Raises:
        trees.TreeError: the tree file has findings.
        ValueError: a script that cannot be read, that its leaf cannot do, or whose leaf the tree does not have.
    """

    def __init__(
        self,
        path: Path,
        script: Mapping[str, str] | None = None,
        *,
        default: str = "success",
        leaves: Mapping[str, type] | None = None,
        inputs: Mapping[str, str] | None = None,
    ) -> None:
        if leaves is None:
            leaves = _installed(path)
        self.tree = py_trees.trees.BehaviourTree(load_tree(path, stand_ins(leaves), inputs))
        self.ticks = 0
        silent = SimpleNamespace(info=_nothing, warning=_nothing)
        networks = networks_named_in(path)
        # for our decorators and composites
        services = SimpleNamespace(clock=self, log=silent, networks=networks, seen=lambda state: {})
        self.tree.setup(services=services)
        self._table = TickTable(self.tree.root)
        self.tree.add_visitor(self._table)
        paths = node_paths(self.tree.root)
        nodes = [node for node in in_tree_order(self.tree.root) if isinstance(node, ScriptedLeaf)]
        self.leaves = {paths[node.id]: node for node in nodes}
        self._hand_out(script or {}, default)

    def _hand_out(self, script: Mapping[str, str], default: str) -> None:
        tags = {type(leaf).__name__ for leaf in self.leaves.values()}
        by_path = {find_path(name, self.leaves): text for name, text in script.items() if name not in tags}
        usual = parse_script(default)
        for path, leaf in self.leaves.items():
            text = by_path.get(path, script.get(type(leaf).__name__))
            if text is None:
                leaf.acts = tuple(_able(act, leaf.RETURNS) for act in usual)
            else:
                leaf.acts = _checked(path, parse_script(text), leaf.RETURNS)

    @property
    def status(self) -> Status:
        """The root's status."""
        return cast(Status, self.tree.root.status)

    @property
    def running(self) -> list[str]:
        """Paths of the leaves that are RUNNING, in tree order."""
        return [path for path, leaf in self.leaves.items() if leaf.status is Status.RUNNING]

    @property
    def unfinished(self) -> str:
        """What keeps the tree RUNNING, in words: leaves, or nodes above leaves that have ended."""
        paths = node_paths(self.tree.root)
        nodes = [node for node in in_tree_order(self.tree.root) if node.status is Status.RUNNING]
        lowest = [n for n in nodes if not any(child.status is Status.RUNNING for child in n.children)]
        return ", ".join(f"{type(node).__name__} {paths[node.id]}" for node in lowest)

    def now(self) -> float:
        """Simulated seconds at the latest tick, 0 before the first."""
        return TICK * max(self.ticks - 1, 0)

    def entered(self, leaf: str) -> int:
        """How often a leaf, by its path or the path's last parts, was entered."""
        return self.leaves[find_path(leaf, self.leaves)].entered

    def tick(self) -> Status:
        """Tick once; the root's status."""
        self.ticks += 1
        self.tree.tick()
        return self.status

    def run(self, until: int | None = None, max_ticks: int = MAX_TICKS) -> Status:
        """Tick until the tree ends, or until tick number `until`; the root's status.

        Raises:
            RuntimeError: without `until`, the tree has not ended after `max_ticks`; the message says what still runs.
        """
        while self.ticks < (until or max_ticks) and self.tick() is Status.RUNNING:
            pass
        if until is None and self.status is Status.RUNNING:
            raise RuntimeError(
                f"the tree still runs after {self.ticks} ticks, in {self.unfinished}; script how that ends"
            )
        return self.status

    def cancel_at(self, tick: int) -> None:
        """Run until tick number `tick`, then stop the tree as Ctrl-C stops a run."""
        self.run(tick)
        self.tree.root.stop(Status.INVALID)
        self._table.stopped()

    def table(self, *nodes: str) -> str:
        """What the nodes did at each tick (`TickTable.text`): the root and the leaves entered, or those named."""
        return self._table.text(*nodes)
