"""The tree that will run: its subtrees expanded, its ports wired to blackboard keys as py_trees' parser does it.

A key that a leaf class declares is a wire like a port's.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from regrasp.behaviors.keys import Key
from regrasp.interfaces.quote import cut, quoted
from regrasp.trees.element import Element, key_of
from regrasp.trees.vocabulary import Attribute, ElementKind

# With subtrees expanded: a few nested ones could stand for billions of nodes, and building and ticking are recursive.
MAX_NODES = 2000
MAX_TREE_DEPTH = 150


@dataclass(frozen=True)
class Wire:
    """A port that is wired to a blackboard key, or a declared `key`.

    `what` is its name in messages, `line` its place in the file, `path` the key, `type` that of its values. The type is
    None where it is unknown: of a declared key, and of a misspelt port or element, which may be meant to write.
    """

    what: str
    line: int
    path: str
    type: Any
    required: bool = False  # a reader that needs a value
    seeded: bool = False  # a writer whose default is on the blackboard from the start
    key: Key[Any] | None = None


@dataclass(eq=False)
class ExpandedNode:
    """A node of the tree that will run; `kind` is None for a subtree and for an unknown element.

    `constants` are its attributes' literals, also those passed through a subtree's keys.
    """

    element: Element
    kind: ElementKind | None = None
    children: list["ExpandedNode"] = field(default_factory=list)
    reads: list[Wire] = field(default_factory=list)
    writes: list[Wire] = field(default_factory=list)
    constants: dict[str, str] = field(default_factory=dict)

    def walk(self) -> Iterator["ExpandedNode"]:
        """This node and all below it, in tick order."""
        yield self
        for child in self.children:
            yield from child.walk()


@dataclass(frozen=True)
class _Source:
    """The source of a value: a blackboard path, or a constant."""

    text: str
    is_constant: bool


@dataclass(frozen=True)
class _Scope:
    """One subtree instance: its namespace, and the keys that the SubTree element maps."""

    namespace: str
    keys: Mapping[str, _Source]

    def source(self, value: str) -> _Source:
        """The source of an attribute's value; malformed braces count as a constant, `check_tree` reports them."""
        try:
            key = key_of(value)
        except ValueError:
            key = None
        if key is None:
            return _Source(value, is_constant=True)
        return self.keys.get(key, _Source(f"{self.namespace}/{key}", is_constant=False))

    def inner(self, tree: Element, call: Element | None = None) -> "_Scope":
        """The scope of a subtree that is included here by `call`; without a call, that of the main tree."""
        values = {**tree.attributes, **(call.attributes if call else {})}
        keys = {name: self.source(value) for name, value in values.items() if name not in ("ID", "name")}
        return _Scope(f"{self.namespace}/{call.name}" if call else "", keys)


class TreeTooLarge(Exception):  # noqa: N818 - it stops the expansion
    """The tree grows beyond `MAX_NODES` or `MAX_TREE_DEPTH`; the message is the finding."""


class ExpandedTree:
    """The main tree with its subtrees expanded: `root`, and the `findings` (line, message) about its wires.

    Raises:
        TreeTooLarge: too many nodes or levels, also where trees include one another in a loop.
    """

    def __init__(self, main: Element, trees: Mapping[str, Element], kinds: Mapping[str, ElementKind]) -> None:
        self._trees, self._kinds, self._count = trees, kinds, 0
        self.findings: list[tuple[int, str]] = []
        self.root = ExpandedNode(main)
        self._expand(self.root, main, _Scope("", {}).inner(main), 1)
        nodes = [*self.root.walk()]
        self._connect_keys(nodes)
        self.findings += _mistyped(nodes)

    def _expand(self, node: ExpandedNode, parent: Element, scope: _Scope, depth: int) -> None:
        for child in parent.children:
            self._count += 1
            if self._count > MAX_NODES:
                raise TreeTooLarge(f"more than {MAX_NODES} nodes once the subtrees are expanded; include fewer")
            if depth > MAX_TREE_DEPTH:
                raise TreeTooLarge(f"deeper than {MAX_TREE_DEPTH} nodes once the subtrees are expanded; nest fewer")
            inner = ExpandedNode(child, self._kinds.get(child.tag))
            node.children.append(inner)
            if child.tag != "SubTree":
                self._connect(inner, scope)
                self._expand(inner, child, scope, depth + 1)
            elif tree := self._trees.get(child.attributes.get("ID", "")):
                self._expand(inner, tree, scope.inner(tree, child), depth + 1)

    def _connect(self, node: ExpandedNode, scope: _Scope) -> None:
        """Sort the node's attributes into reads, writes and constants; add findings about values passed by keys."""
        element = node.element
        for name, value in element.attributes.items():
            source = scope.source(value)
            attribute = node.kind.attributes.get(name) if node.kind else None
            what = f"{element.label}: {cut(name)}={cut(value)}"
            if attribute is None:
                if not source.is_constant:
                    node.writes.append(Wire(what, element.line, source.text, None))
                continue
            if source.is_constant:
                node.constants[name] = source.text
            if value.startswith("{") and attribute.takes_key:  # literals are checked where they stand
                self._wire(node, what, attribute, source)

    def _connect_keys(self, nodes: list[ExpandedNode]) -> None:
        """Add the declared keys to reads and writes. An element that nobody knows may be meant to write any of them."""
        needed = {key for node in nodes if node.kind for key in node.kind.needs}
        for node in nodes:
            element = node.element
            if node.kind:
                node.reads += [_key_wire(element, key, required=True) for key in node.kind.needs]
                node.writes += [_key_wire(element, key) for key in node.kind.writes]
            elif element.tag not in ("BehaviorTree", "SubTree"):
                node.writes += [_key_wire(element, key) for key in needed]

    def _wire(self, node: ExpandedNode, what: str, attribute: Attribute, source: _Source) -> None:
        wrong = None
        if source.is_constant and attribute.is_output:
            wrong = f"is an output, but {quoted(source.text)} is given for the key; give it a {{key}}"
        elif source.is_constant:
            problem = attribute.problem(source.text)
            wrong = problem and f"is {quoted(source.text)} here, which {problem}"
        elif not attribute.is_port:
            wrong = "must be a constant, also through a subtree's keys; write a literal"
        else:
            type_ = str if isinstance(attribute.accepts, tuple) else attribute.accepts
            seeded = attribute.is_output and attribute.default is not None
            wire = Wire(what, node.element.line, source.text, type_, attribute.required, seeded)
            (node.writes if attribute.is_output else node.reads).append(wire)
        if wrong:
            self.findings.append((node.element.line, f"{what} {wrong}"))


def _key_wire(element: Element, key: Key[Any], required: bool = False) -> Wire:
    return Wire(element.label, element.line, key.path, None, required, key=key)


def _mistyped(nodes: list[ExpandedNode]) -> Iterator[tuple[int, str]]:
    """Findings about keys that get values of two types, or of a type that their reader does not take."""
    first: dict[str, Wire] = {}
    for wire in (wire for node in nodes for wire in node.writes if wire.type is not None):
        other = first.setdefault(wire.path, wire)
        if wire.type != other.type:
            message = f"{wire.what} writes {_name(wire.type)}, but line {other.line} writes {_name(other.type)} to it"
            yield wire.line, f"{message}; write one type, or use two keys"
    for wire in (wire for node in nodes for wire in node.reads if wire.path in first):
        written = first[wire.path]
        if _never(written.type, wire.type):
            message = f"{wire.what} reads {_name(wire.type)}, but line {written.line} writes {_name(written.type)}"
            yield wire.line, f"{message} to it; wire ports of one type"


def _never(written: Any, read: Any) -> bool:
    """Whether no value of one type is also of the other; False for anything but plain classes."""
    if not (isinstance(written, type) and isinstance(read, type)):
        return False
    return not issubclass(written, read) and not issubclass(read, written)


def _name(type_: Any) -> str:
    return type_.__name__ if isinstance(type_, type) else str(type_)
