"""The texts on a node that the picture formats share."""

from collections.abc import Iterator

from regrasp.trees.graph import Node, NodeKind

SYMBOLS: dict[NodeKind, str] = {"sequence": "→", "fallback": "?", "parallel": "⇉", "control": "≡", "decorator": "δ"}


def heading(node: Node) -> str:
    """Symbol and name; a star at the symbol for memory: →* mission."""
    star = "*" if node.memory else ""
    return f"{SYMBOLS.get(node.kind, '')}{star} {node.name}".strip()


def details(node: Node) -> list[str]:
    """Lines below the name: type (unless symbol or name say it), policy and ports; hidden nodes; a run's stats.

    Colours, not texts, show that a run never visited a node.
    """
    said = node.type if _says_type(node) else ""
    about = " ".join(filter(None, [said, node.policy, node.subtree, *(port.text for port in node.given)]))
    hidden = f"+{node.hidden} node{'' if node.hidden == 1 else 's'}" if node.hidden else ""
    run = node.stats.text if node.stats and node.stats.visits else ""
    return [line for line in (about, node.note, hidden, run) if line]


def tooltip(node: Node) -> str:
    """Everything known about a node, one fact per line."""
    memory = {True: " with memory", False: " without memory", None: ""}[node.memory]
    facts = [node.path, f"{node.type}{memory}", node.policy, node.subtree]
    facts += [f"{port.direction} {port.text}" for port in node.given]
    facts += [f"{port.direction} {port.name}, default {port.default}" for port in node.ports if port.value is None]
    facts += [node.note, node.stats.text if node.stats else "", "on the path that failed" if node.failed else ""]
    return "\n".join(filter(None, facts))


def _says_type(node: Node) -> bool:
    own = node.name.replace("_", "").replace("-", "").lower()
    return node.kind in ("control", "decorator", "action", "condition") and own != node.type.lower()


def identifiers(root: Node) -> dict[str, str]:
    """A short word for each node by its path: n0, n1, ... in tree order."""
    return {node.path: f"n{i}" for i, node in enumerate(root.walk())}


def links(root: Node) -> Iterator[tuple[Node, Node]]:
    """Each node with each of its children; in place of a subtree the top node inside it."""
    for parent in root.walk():
        if parent.kind != "subtree":
            for child in parent.children:
                yield parent, _top(child)


def _top(node: Node) -> Node:
    return _top(node.children[0]) if node.kind == "subtree" and node.children else node
