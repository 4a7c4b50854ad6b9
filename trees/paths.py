"""Tree paths: the names by which logs, golden files and results know a node (py_trees' ids are random)."""

from collections.abc import Iterable, Iterator
from difflib import get_close_matches
from uuid import UUID

import py_trees

from regrasp.interfaces.quote import quoted


def in_tree_order(root: py_trees.behaviour.Behaviour) -> Iterator[py_trees.behaviour.Behaviour]:
    """Every node, a parent before its children, siblings from left to right."""
    yield root
    for child in root.children:
        yield from in_tree_order(child)


def node_paths(root: py_trees.behaviour.Behaviour) -> dict[UUID, str]:
    """The path of each node by its id, in tree order: root/search/look, with the names of subtrees.

    A loaded node's name is already its dotted path; one built by hand gets its parent's path before its name. Equal
    siblings, which a checked tree file cannot have, become name and name#2.
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


def find_path(name: str, paths: Iterable[str]) -> str:
    """The only path that is `name` or ends with its parts: carry/move for root/carry/move.

    Raises:
        ValueError: none does, or several.
    """
    known = list(paths)
    found = [path for path in known if path == name] or [path for path in known if path.endswith(f"/{name}")]
    if len(found) == 1:
        return found[0]
    if found:
        raise ValueError(f"{quoted(name)} may be {' or '.join(found)}; write more of the path")
    nearest = get_close_matches(name, [path.rsplit("/", 1)[-1] for path in known], 1, 0.5) or known
    raise ValueError(f"the tree has no node {quoted(name)}; there is {', '.join(dict.fromkeys(nearest))}")
