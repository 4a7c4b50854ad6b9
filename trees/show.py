"""A tree as text to look at."""

from collections.abc import Iterator
from pathlib import Path

from regrasp.trees.graph import Node, on_one_line, read_graph


def show_tree(path: Path) -> str:
    """The tree that a file describes, as `to_ascii` draws it. Needs no leaf classes.

    Raises:
        OSError: the file cannot be read.
        TreeSyntaxError: it is not well-formed.
        ValueError: it has no main tree, or more nodes or depth than a tree may have.
    """
    return to_ascii(read_graph(path, {}))


def to_ascii(root: Node) -> str:
    """The tree with its subtrees filled in, a line a node: name, type, memory or policy, ports; of a run, its stats."""
    return "\n".join([_label(root), *_below(root, "")])


def _below(parent: Node, indent: str) -> Iterator[str]:
    for child in parent.children:
        fork, rail = ("└─ ", "   ") if child is parent.children[-1] else ("├─ ", "│  ")
        yield f"{indent}{fork}{_label(child)}"
        yield from _below(child, indent + rail)


def _label(node: Node) -> str:
    memory = {True: "with memory", False: "without memory", None: ""}[node.memory]
    words = [f"{node.name} ", node.type, memory, node.policy, node.subtree, *(port.text for port in node.given)]
    words += [f" ({node.note})"] * bool(node.note) + [f" +{node.hidden} nodes"] * bool(node.hidden)
    words += [f" [{node.stats.text}]"] if node.stats else []
    words += [" FAILED"] * node.failed
    return on_one_line(" ".join(filter(None, words)))
