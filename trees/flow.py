"""Data flow analysis of a tree: nodes never reached, Parallels that never succeed, keys read before they are written.

It follows all possible runs at once: a leaf may end every tick in any status that it `RETURNS`. A finding is what is
impossible in every run, so a tree that can work has no findings.
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from functools import reduce
from operator import or_
from typing import NamedTuple

from py_trees.common import Status

from regrasp.interfaces.quote import cut
from regrasp.trees.vocabulary import ANY_STATUS, BUILT_IN, ElementKind
from regrasp.trees.wiring import ExpandedNode, Wire

SUCCESS, FAILURE, RUNNING = Status.SUCCESS, Status.FAILURE, Status.RUNNING


class Runs(NamedTuple):
    """The runs that come to some point, as bit sets. Bit i is the ith reader of a key, bit 0 a reader never ticked.

    A bit in `fresh`: in some run that reader has not been ticked yet. In `written`: in some such run its key may also
    have been written. Only a reader's first tick counts: if its key has no value then, the run ends.
    """

    fresh: int = 0
    written: int = 0

    def __or__(self, other: "Runs") -> "Runs":
        return Runs(self.fresh | other.fresh, self.written | other.written)

    def after(self, earlier: "Runs") -> "Runs":
        """Those of these runs that may have passed an earlier point."""
        return Runs(self.fresh & earlier.fresh, self.written & earlier.fresh)


Ends = dict[Status, Runs]  # the runs in which a node ends a tick in each status
_TO: dict[str, dict[Status, tuple[Status, ...]]] = {  # what decorators make of a status; the others pass
    "FailureIsRunning": {FAILURE: (RUNNING,)},
    "FailureIsSuccess": {FAILURE: (SUCCESS,)},
    "Inverter": {FAILURE: (SUCCESS,), SUCCESS: (FAILURE,)},
    "Repeat": {SUCCESS: (SUCCESS, RUNNING)},
    "Retry": {FAILURE: (FAILURE, RUNNING)},
    "RunningIsFailure": {RUNNING: (FAILURE,)},
    "RunningIsSuccess": {RUNNING: (SUCCESS,)},
    "SuccessIsFailure": {SUCCESS: (FAILURE,)},
    "SuccessIsRunning": {SUCCESS: (RUNNING,)},
    "TimeLimit": {RUNNING: (RUNNING, FAILURE)},
}
_GOES_ON = {"Sequence": SUCCESS, "Fallback": FAILURE, "Selector": FAILURE}


def check_flow(root: ExpandedNode, known: Mapping[str, ElementKind]) -> Iterator[tuple[int, str]]:
    """Findings (line, sentence) about what no run of the tree can do; `known` are the kinds of elements by tag."""
    flow = _Flow(root)
    nodes = [*root.walk()]
    yield from _unreachable(nodes, flow)
    yield from _hopeless(nodes, flow)
    writers: dict[str, list[Wire]] = {}
    for wire in (wire for node in nodes for wire in node.writes):
        writers.setdefault(wire.path, []).append(wire)
    too_early = flow.too_early
    for reader in flow.readers:
        # A leaf that writes what it needs is no help to itself.
        others = [wire for wire in writers.get(reader.path, []) if (wire.line, wire.what) != (reader.line, reader.what)]
        if not others:
            yield reader.line, _unwritten(reader, known)
        elif reader in too_early:
            yield reader.line, _early(reader, others[0])


def _unwritten(reader: Wire, known: Mapping[str, ElementKind]) -> str:
    """The sentence about a reader whose key nothing writes."""
    if reader.key is None:
        return f"{reader.what} reads {cut(reader.path)}, which no port writes; wire an output to it"
    path = reader.path
    tags = [
        tag
        for tag, kind in known.items()
        if path in (key.path for key in kind.writes) and path not in (key.path for key in kind.needs)
    ]
    right = f"tick {' or '.join(tags)} before it" if tags else "no leaf that is known does, so remove it"
    return f"{reader.what} needs {reader.key.text}, which nothing in this tree writes; {right}"


def _early(reader: Wire, writer: Wire) -> str:
    """The sentence about a reader that is ticked before the writer of its key can have been."""
    right = f"tick {writer.what.partition(':')[0]} of line {writer.line} before it"
    if reader.key is None:
        return f"{reader.what} reads {cut(reader.path)} before anything can have written it; {right}"
    return f"{reader.what} needs {reader.key.text}, which nothing can have written before it; {right}"


def _unreachable(nodes: list[ExpandedNode], flow: "_Flow") -> Iterator[tuple[int, str]]:
    """Nodes that no run reaches; in a subtree, only if no place that includes it reaches the element."""
    reached = {id(node.element) for node in nodes if node in flow.ends}
    for parent in nodes:
        never = [child for child in parent.children if id(child.element) not in reached]
        if parent in flow.ends and never:
            child = never[0]  # those after it are unreachable for the same reason
            before = [other for other in parent.children if other in flow.ends][-1]
            ends = "fails" if _GOES_ON[parent.element.tag] is FAILURE else "succeeds"
            message = f"{child.element.label} is never reached: {before.element.label} before it never {ends}"
            yield child.element.line, f"{message}; move it before that, or remove it"


def _hopeless(nodes: list[ExpandedNode], flow: "_Flow") -> Iterator[tuple[int, str]]:
    """Parallels that can succeed in no place of the tree; the message describes the first place."""
    parallels: dict[int, list[ExpandedNode]] = {}
    for node in nodes:
        if node.element.tag == "Parallel" and node in flow.ends:
            parallels.setdefault(id(node.element), []).append(node)
    for places in parallels.values():
        parallel = places[0]
        element, policy = parallel.element, parallel.constants.get("policy")
        if policy not in ("success_on_all", "success_on_one") or any(flow.can(node, SUCCESS) for node in places):
            continue
        never = [child for child in parallel.children if not flow.can(child, SUCCESS)]
        fails = [child for child in parallel.children if flow.only(child, FAILURE)]
        if fails:
            why = f"{fails[0].element.label} always fails; take it out"
        elif policy == "success_on_one":
            why = "none of its children ever does; give it one that does"
        else:
            why = f'{never[0].element.label} never does; write policy="success_on_one", or take it out'
        yield element.line, f"{element.label} can never succeed with {policy}: {why}"


class _Flow:
    """All runs of a tree: in `ends` the nodes that some run reaches, with the statuses in which it leaves them."""

    def __init__(self, root: ExpandedNode) -> None:
        nodes = [*root.walk()]
        self.ends: dict[ExpandedNode, Ends] = {}
        self.readers = [wire for node in nodes for wire in node.reads if wire.required]
        self._own: dict[ExpandedNode, int] = {}  # bits of the node's own reads
        self._served: dict[ExpandedNode, int] = {}  # bits of the readers of the keys that the node writes
        of_path: dict[str, int] = {}
        for bit, (node, wire) in enumerate(((n, w) for n in nodes for w in n.reads if w.required), 1):
            self._own[node] = self._own.get(node, 0) | 1 << bit
            of_path[wire.path] = of_path.get(wire.path, 0) | 1 << bit
        seeded = 0
        for node in nodes:
            for wire in node.writes:
                self._served[node] = self._served.get(node, 0) | of_path.get(wire.path, 0)
                seeded |= of_path.get(wire.path, 0) if wire.seeded else 0
        self._met, self._in_time = 0, 0  # bits of the readers that some run ticks, and of those that then find a value
        runs = Runs((2 << len(self.readers)) - 1, seeded)
        self._changed = True
        while self._changed:
            self._changed = False
            runs |= self._tick(root, runs)[RUNNING]

    @property
    def too_early(self) -> list[Wire]:
        """The readers that are ticked, but in no run after their key has been written."""
        late = self._met & ~self._in_time
        return [wire for bit, wire in enumerate(self.readers, 1) if late >> bit & 1]

    def can(self, node: ExpandedNode, status: Status) -> bool:
        """Whether some run leaves the node in this status."""
        return bool(self.ends[node][status].fresh)

    def only(self, node: ExpandedNode, status: Status) -> bool:
        """Whether every run that leaves the node leaves it in this status."""
        return not any(self.can(node, other) for other in ANY_STATUS - {status})

    def _tick(self, node: ExpandedNode, runs: Runs) -> Ends:
        """The runs after a tick of this node."""
        if not runs.fresh:
            return _none()
        ends = self._rule(node)(node, self._wired(node, runs))
        if ends != self.ends.get(node):
            self.ends[node], self._changed = ends, True
        return ends

    def _wired(self, node: ExpandedNode, runs: Runs) -> Runs:
        """The runs after the node has read its inputs and may have written its outputs."""
        own = self._own.get(node, 0)
        self._met |= runs.fresh & own
        self._in_time |= runs.written & own
        fresh = runs.fresh & ~own
        return Runs(fresh, runs.written & ~own | fresh & self._served.get(node, 0))

    def _ended(self, node: ExpandedNode) -> Ends:
        return self.ends.get(node) or _none()

    def _rule(self, node: ExpandedNode) -> Callable[[ExpandedNode, Runs], Ends]:
        tag = node.element.tag
        built_in = tag in _TO or node.kind is BUILT_IN.get(
            tag
        )  # None is None: a subtree, or an element that nobody knows
        if built_in and node.children:
            if tag in _GOES_ON:
                return self._in_turn
            if tag == "Parallel":
                return self._parallel
            if len(node.children) == 1 and (node.kind or tag in ("BehaviorTree", "SubTree")):
                return self._decorated
        return self._any

    def _any(self, node: ExpandedNode, runs: Runs) -> Ends:
        """A leaf, or a node of an unknown kind: it may tick its children in any order."""
        for child in node.children:
            for end in self._ended(child).values():
                runs |= end
        for child in node.children:
            self._tick(child, runs)
        return _none() | dict.fromkeys(node.kind.returns if node.kind else ANY_STATUS, runs)

    def _decorated(self, node: ExpandedNode, runs: Runs) -> Ends:
        tag, child, ends = node.element.tag, node.children[0], _none()
        for status, end in self._tick(child, runs).items():
            if tag == "OneShot" and status is not RUNNING:  # its earlier end, without a tick of the child
                end |= runs.after(end)
            for becomes in _becomes(node, status):
                ends[becomes] |= end
        return ends

    def _in_turn(self, node: ExpandedNode, runs: Runs) -> Ends:
        """Sequence and Fallback; with memory a tick may begin at any child that was running."""
        ends, goes_on = _none(), _GOES_ON[node.element.tag]
        at = runs
        for child in node.children:
            if node.constants.get("memory") != "false":
                at |= runs.after(self._ended(child)[RUNNING])
            tick = self._tick(child, at)
            for status in ANY_STATUS - {goes_on}:
                ends[status] |= tick[status]
            at = tick[goes_on]
        ends[goes_on] = at
        return ends

    def _parallel(self, node: ExpandedNode, runs: Runs) -> Ends:
        """Ticks every child; with success_on_all a child that has succeeded is skipped until all have."""
        on_all, end, ticks = node.constants.get("policy") == "success_on_all", runs, []
        for child in node.children:
            rest = end.after(self._ended(child)[SUCCESS]) if on_all else Runs()
            tick = self._tick(child, end)
            ticks.append(tick | {SUCCESS: tick[SUCCESS] | rest})
            end = _union([rest, *tick.values()])
        some = {status: end.after(_union([tick[status] for tick in ticks])) for status in ANY_STATUS}
        calm, succeeded, running = end, end, end  # no child fails, all succeed, all are running
        for tick in ticks:
            calm = calm.after(tick[SUCCESS] | tick[RUNNING])
            succeeded, running = succeeded.after(tick[SUCCESS]), running.after(tick[RUNNING])
        if on_all:
            return {FAILURE: some[FAILURE], SUCCESS: succeeded, RUNNING: calm.after(some[RUNNING])}
        return {FAILURE: some[FAILURE], SUCCESS: calm.after(some[SUCCESS]), RUNNING: running}


def _none() -> Ends:
    return dict.fromkeys((SUCCESS, FAILURE, RUNNING), Runs())


def _union(many: list[Runs]) -> Runs:
    return reduce(or_, many, Runs())


def _becomes(node: ExpandedNode, status: Status) -> Collection[Status]:
    """The statuses that a decorator may make of its child's."""
    tag = node.element.tag
    if tag == "Condition":
        waits_for = node.constants.get("status")
        if waits_for not in ("success", "failure", "running"):
            return (SUCCESS, RUNNING)
        return (SUCCESS,) if waits_for == status.value.lower() else (RUNNING,)
    if "1" in (node.constants.get("num_failures"), node.constants.get("num_success")):
        return (status,)  # a Retry or Repeat of one try
    return _TO.get(tag, {}).get(status, (status,))
