"""Tree paths: the names by which logs, golden files and results know a node (py_trees' ids are random)."""

from collections.abc import Iterator
from uuid import UUID

import py_trees


def in_tree_order(root: py_trees.behaviour.Behaviour) -> Iterator[py_trees.behaviour.Behaviour]:
    """Every node, a parent before its children, siblings from left to right."""
    yield root
    for child in root.children:
        yield from in_tree_order(child)


def node_paths(root: py_trees.behaviour.Behaviour) -> dict[UUID, str]:
    """The path of each node by its id, in tree order: root/search/look, with the names of subtrees.

    A loaded node's name is already its dotted path; one built by hand gets its parent's path before its name. Equal
    siblings, which a checked tree file cannot have, are told apart as name, name#2.
    """
    paths: dict[UUID, str] = {}
    taken: set[str] = set()
    for node in in_tree_order(root):
        own = node.name
        if node is not root:
            own = f"{paths[node.parent.id]}/{own.removeprefix(node.parent.name + '.').replace('.', '/')}"
        else:
            own = own.replace(".", "/")
        path, copy = own, 1
        while path in taken:
            copy += 1
            path = f"{own}#{copy}"
        taken.add(path)
        paths[node.id] = path
    return paths
