"""Where the values of ports come from, followed through subtrees as py_trees' parser does."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from trees.element import Element, key_of
from trees.vocabulary import Kind

# After subtrees are filled in: a few nested ones could stand for billions of nodes, and building and ticking recurse.
MAX_NODES = 2000
MAX_TREE_DEPTH = 150


@dataclass(frozen=True)
class _Source:
    """What a key stands for: a blackboard path, or a constant."""

    text: str
    is_constant: bool


@dataclass
class _Wires:
    readers: list[tuple[int, str, str]] = field(default_factory=list)  # line, port, blackboard path
    written: set[str] = field(default_factory=set)
    nodes: int = 0
    depth: int = 0


@dataclass(frozen=True)
class _Scope:
    """One subtree instance: its namespace, and the keys that its caller maps."""

    namespace: str
    keys: Mapping[str, _Source]

    def source(self, value: str) -> _Source:
        """What an attribute's value stands for; braces that make no key are a finding elsewhere."""
        try:
            key = key_of(value)
        except ValueError:
            key = None
        if key is None:
            return _Source(value, is_constant=True)
        return self.keys.get(key, _Source(f"{self.namespace}/{key}", is_constant=False))


def check_wiring(root: Element, trees: Mapping[str, Element], kinds: Mapping[str, Kind]) -> list[tuple[int, str]]:
    """Findings (line, sentence) about the keys of the main tree; `trees` must not include one another in a loop.

    A key that is read must be written somewhere; a decorator's argument and a literal handed to a subtree must suit.
    """
    main = trees.get(root.attributes.get("main_tree_to_execute", ""))
    if main is None:
        return []
    wires = _Wires()
    findings = [*_follow(main, _Scope("", _mapped(main, {}, _Scope("", {}))), trees, kinds, wires)]
    if wires.nodes > MAX_NODES:
        return [(root.line, f"more than {MAX_NODES} nodes once the subtrees are filled in")]
    if wires.depth > MAX_TREE_DEPTH:
        return [(root.line, f"deeper than {MAX_TREE_DEPTH} nodes once the subtrees are filled in")]
    return findings + [
        (line, f"{port} reads {path}, which no port writes")
        for line, port, path in wires.readers
        if path not in wires.written
    ]


def _mapped(tree: Element, given: Mapping[str, str], caller: _Scope) -> dict[str, _Source]:
    values = {**tree.attributes, **given}
    return {name: caller.source(value) for name, value in values.items() if name not in ("ID", "name")}


def _follow(
    element: Element,
    scope: _Scope,
    trees: Mapping[str, Element],
    kinds: Mapping[str, Kind],
    wires: _Wires,
    depth: int = 1,
) -> Iterator[tuple[int, str]]:
    for child in element.children:
        wires.nodes += 1
        wires.depth = max(wires.depth, depth)
        if wires.nodes > MAX_NODES or depth > MAX_TREE_DEPTH:
            return
        if child.tag == "SubTree":
            if tree := trees.get(child.attributes.get("ID", "")):
                inner = _Scope(f"{scope.namespace}/{child.name}", _mapped(tree, child.attributes, scope))
                yield from _follow(tree, inner, trees, kinds, wires, depth + 1)
        elif child.tag in kinds:
            yield from _connect(child, scope, kinds[child.tag], wires)
            yield from _follow(child, scope, trees, kinds, wires, depth + 1)


def _connect(element: Element, scope: _Scope, kind: Kind, wires: _Wires) -> Iterator[tuple[int, str]]:
    for name, value in element.attributes.items():
        attribute = kind.attributes.get(name)
        if attribute is None or not value.startswith("{") or not attribute.takes_key:
            continue  # literals are checked where they stand
        source = scope.source(value)
        what = f"{element.tag} {element.name!r}: {name}={value}"
        if attribute.is_output and source.is_constant:
            yield element.line, f"{what} is an output, but the key is a constant"
        elif attribute.is_output:
            wires.written.add(source.text)
        elif source.is_constant:
            if problem := attribute.problem(source.text):
                yield element.line, f"{what} is {source.text!r} here, which {problem}"
        elif not attribute.is_port:
            yield element.line, f"{what} must be a constant, also through a subtree's keys"
        elif attribute.required:
            wires.readers.append((element.line, what, source.text))
