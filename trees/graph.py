"""A tree as one value for every export format: what the file says, with subtrees expanded."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from py_trees.common import Status
from py_trees.composites import Composite

from regrasp.interfaces.quote import quoted
from regrasp.trees.element import Element, key_of, read_elements
from regrasp.trees.leaf_sets import installed_leaves
from regrasp.trees.run_stats import NodeStats
from regrasp.trees.vocabulary import BUILT_IN
from regrasp.trees.wiring import MAX_NODES, MAX_TREE_DEPTH

NodeKind = Literal["sequence", "fallback", "parallel", "control", "decorator", "action", "condition", "subtree"]
_COMPOSITES: dict[str, NodeKind] = {
    "Sequence": "sequence",
    "Fallback": "fallback",
    "Selector": "fallback",
    "Parallel": "parallel",
    "SubTree": "subtree",
}


@dataclass(frozen=True)
class NodePort:
    """A port of a leaf, an argument of a decorator, or a key of a subtree."""

    name: str
    value: str | None = None  # as written; None where the file leaves it out
    constant: str | None = None  # the literal that the value stands for; None where it comes from the blackboard
    direction: Literal["input", "output", "inout"] = "input"
    type: str = "str"
    default: str | None = None

    @property
    def text(self) -> str:
        """Name and value as written, and the constant behind a key: tries={tries}=5."""
        behind = "" if self.constant in (None, self.value) else f"={self.constant}"
        return one_line(f"{self.name}={self.value}{behind}")


@dataclass(frozen=True)
class Node:
    """One node, or a SubTree with the top node of its tree as its only child."""

    path: str  # as `node_paths` names it
    name: str
    type: str  # the element's tag
    kind: NodeKind
    memory: bool | None = None
    policy: str = ""
    ports: tuple[NodePort, ...] = ()
    tree: str = ""  # the ID of the tree that it is written in
    subtree: str = ""  # the ID of a SubTree's tree
    children: tuple["Node", ...] = ()
    note: str = ""  # why a SubTree has no child
    hidden: int = 0  # nodes below that are not shown
    stats: NodeStats | None = None  # of a recorded run
    failed: bool = False  # on the path by which the run failed

    def walk(self) -> Iterator["Node"]:
        """This node and all below it, a parent before its children."""
        yield self
        for child in self.children:
            yield from child.walk()

    @property
    def unvisited(self) -> bool:
        """Whether the tree shows a run that never visited this node."""
        return self.stats is not None and not self.stats.visits

    @property
    def given(self) -> list[NodePort]:
        """The ports that the file gives a value."""
        return [port for port in self.ports if port.value is not None]


@dataclass(frozen=True)
class _Scope:
    """One instance of a tree: the constants of its keys, and the IDs of the trees around it."""

    trees: Mapping[str, Element]
    leaves: Mapping[str, type]
    keys: Mapping[str, str]
    opened: tuple[str, ...]
    budget: Iterator[int] = field(
        default_factory=lambda: iter(range(MAX_NODES))
    )  # one number for each node of the whole tree


def read_graph(path: Path, leaves: Mapping[str, type] | None = None, inputs: Mapping[str, str] | None = None) -> Node:
    """The file's main tree. `leaves` maps a tag to its class, by default those that are installed; others show as
    far as written.

    `inputs` take the place of the main BehaviorTree's default values, as in `load_tree`.

    Raises:
        OSError: the file cannot be read.
        TreeSyntaxError: it is not well-formed.
        ValueError: it has no main tree, or more nodes or depth than a tree may have.
    """
    root = read_elements(path)
    if leaves is None:
        leaves = installed_leaves(root)
    trees = {tree.attributes.get("ID", ""): tree for tree in root.children}
    main = root.attributes.get("main_tree_to_execute", "")
    if main not in trees or not trees[main].children:
        raise ValueError(f"no tree {quoted(main)} with a node in it; name one in main_tree_to_execute")
    keys = _constants(trees[main].attributes | dict(inputs or {}), {})
    return _node(trees[main].children[0], "", _Scope(trees, leaves, keys, (main,)))


def collapsed(node: Node, depth: int) -> Node:
    """The tree with its SubTrees open down to `depth`: at 0 each SubTree in the main tree is a single, closed node."""
    if node.kind == "subtree" and node.children:
        if depth == 0:
            return replace(node, children=(), hidden=sum(n.kind != "subtree" for n in node.walk()))
        depth -= 1
    return replace(node, children=tuple(collapsed(child, depth) for child in node.children))


def recorded(node: Node, stats: Mapping[str, NodeStats], failed: Collection[str] = ()) -> Node:
    """The tree with a run's stats by path, and a mark on the nodes whose paths are in `failed`."""
    children = tuple(recorded(child, stats, failed) for child in node.children)
    if node.kind == "subtree" and children:  # no node of its own in a run
        return replace(node, children=children, stats=children[0].stats, failed=children[0].failed)
    return replace(node, children=children, stats=stats.get(node.path, NodeStats()), failed=node.path in failed)


def _node(element: Element, above: str, scope: _Scope) -> Node:
    path = f"{above}/{element.name}" if above else element.name
    if next(scope.budget, None) is None or path.count("/") >= MAX_TREE_DEPTH:
        raise ValueError(
            f"more than {MAX_NODES} nodes, or deeper than {MAX_TREE_DEPTH}, with its subtrees expanded; include fewer"
        )
    if element.tag == "SubTree":
        return _subtree(element, path, scope)
    leaf = scope.leaves.get(element.tag)
    declared = _declared(element.tag, leaf)
    attributes = dict(element.attributes)
    attributes.pop("name", None)
    memory, policy = attributes.pop("memory", None), attributes.pop("policy", "")
    for own_field in ("memory", "policy"):
        declared.pop(own_field, None)
    given = (_given(declared.pop(name, NodePort(name)), value, scope.keys) for name, value in attributes.items())
    return Node(
        path,
        element.name,
        element.tag,
        _COMPOSITES.get(element.tag) or _leaf_kind(leaf, element),
        None if memory is None else memory == "true",
        policy,
        (*given, *declared.values()),
        scope.opened[-1],
        children=tuple(_node(child, path, scope) for child in element.children),
    )


def _subtree(element: Element, path: str, scope: _Scope) -> Node:
    given = {name: value for name, value in element.attributes.items() if name not in ("ID", "name")}
    identifier = element.attributes.get("ID", "")
    node = Node(path, element.name, element.tag, "subtree", tree=scope.opened[-1], subtree=identifier)
    ports = {name: _given(NodePort(name), value, scope.keys) for name, value in given.items()}
    if identifier in scope.opened or not (tree := scope.trees.get(identifier)) or not tree.children:
        note = "includes itself" if identifier in scope.opened else "missing"
        return replace(node, ports=tuple(ports.values()), note=note)
    inner = replace(scope, keys=_constants(tree.attributes | given, scope.keys), opened=(*scope.opened, identifier))
    child = _node(tree.children[0], path, inner)
    for name, value in tree.attributes.items():
        if name != "ID":
            ports[name] = replace(ports.get(name, NodePort(name)), default=value)
    typed = (_used(port, child) for port in ports.values())
    return replace(node, ports=tuple(typed), children=(child,))


def _given(port: NodePort, value: str, keys: Mapping[str, str]) -> NodePort:
    return replace(port, value=value, constant=_constant(value, keys))


def _constant(value: str, keys: Mapping[str, str]) -> str | None:
    try:
        key = key_of(value)
    except ValueError:  # a finding of the check
        key = None
    return value if key is None else keys.get(key)


def _constants(attributes: Mapping[str, str], keys: Mapping[str, str]) -> dict[str, str]:
    """The literals that a tree's attributes pass to its nodes."""
    known = {name: _constant(value, keys) for name, value in attributes.items() if name not in ("ID", "name")}
    return {name: value for name, value in known.items() if value is not None}


def _used(port: NodePort, top: Node) -> NodePort:
    """A subtree's key with type and direction of the ports inside to which it is wired."""
    inside = [p for node in _same_tree(top) for p in node.ports if p.value == f"{{{port.name}}}"]
    directions = {p.direction for p in inside} or {"input"}
    types = {p.type for p in inside}
    return replace(
        port,
        direction=directions.pop() if len(directions) == 1 else "inout",
        type=types.pop() if len(types) == 1 else "str",
    )


def _same_tree(node: Node) -> Iterator[Node]:
    yield node
    if node.kind != "subtree":
        for child in node.children:
            yield from _same_tree(child)


def _declared(tag: str, leaf: Any) -> dict[str, NodePort]:
    """The ports that an element has, by name; none are known of a leaf without class."""
    if leaf is None:
        arguments = BUILT_IN[tag].attributes if tag in BUILT_IN else {}
        return {name: NodePort(name, type=_name(argument.accepts)) for name, argument in arguments.items()}
    ports: dict[str, NodePort] = {}
    for name, port in leaf.input_ports().items():
        default = str(port.default_value) if port.has_default else None
        ports[name] = NodePort(name, type=_name(port.data_type), default=default)
    for name, port in leaf.output_ports().items():
        ports[name] = NodePort(name, direction="output", type=_name(port.data_type))
    return ports


def _name(kind: Any) -> str:
    """A type's name; an attribute that takes one of several words is a str."""
    return "str" if isinstance(kind, tuple) else getattr(kind, "__name__", str(kind))


def _leaf_kind(leaf: Any, element: Element) -> NodeKind:
    if isinstance(leaf, type) and issubclass(leaf, Composite):
        return "control"  # a composite that is not built in, as BehaviorTree.CPP calls it
    if element.children:
        return "decorator"
    at_once = getattr(leaf, "RETURNS", None) == {Status.SUCCESS, Status.FAILURE}  # an answer, with no work to wait for
    return "condition" if at_once else "action"


def one_line(text: str) -> str:
    """The text with spaces for unprintable characters: a file must not control a terminal or break lines."""
    return "".join(c if c.isprintable() else " " for c in text)
