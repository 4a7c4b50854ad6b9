"""The nodes of a tree file by their paths, without building the tree."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from trees.element import Element, read_elements
from trees.wiring import MAX_NODES, MAX_TREE_DEPTH


@dataclass(frozen=True)
class OutlineNode:
    """A node as tick logs name it, its type as the file writes it, and how deep it stands (the root at 0)."""

    path: str
    type: str
    depth: int


def outline(path: Path) -> list[OutlineNode]:
    """All nodes in tree order with subtrees filled in; [] for a file without a main tree. Needs no leaf classes.

    Raises:
        OSError: the file cannot be read.
        TreeSyntaxError: it is not well-formed.
        ValueError: more nodes or depth than a tree may have (as of one that includes itself).
    """
    root = read_elements(path)
    trees = {tree.attributes.get("ID", ""): tree for tree in root.children}
    main = trees.get(root.attributes.get("main_tree_to_execute", ""))
    nodes: list[OutlineNode] = []
    for node in _below(main, trees, "", 0, MAX_TREE_DEPTH) if main else ():
        nodes.append(node)
        if len(nodes) > MAX_NODES:
            raise ValueError(f"more than {MAX_NODES} nodes once the subtrees are filled in")
    return nodes


def _below(
    parent: Element, trees: Mapping[str, Element], prefix: str, depth: int, levels: int
) -> Iterator[OutlineNode]:
    if levels == 0:
        raise ValueError(f"deeper than {MAX_TREE_DEPTH} once the subtrees are filled in")
    for child in parent.children:
        path = f"{prefix}{child.name}"
        if child.tag != "SubTree":
            yield OutlineNode(path, child.tag, depth)
            yield from _below(child, trees, f"{path}/", depth + 1, levels - 1)
        elif inner := trees.get(child.attributes.get("ID", "")):
            yield from _below(inner, trees, f"{path}/", depth, levels - 1)
