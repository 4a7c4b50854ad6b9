"""Random trees as the writers take them: odd names and texts, subtrees in subtrees, collapsed nodes, runs."""

from dataclasses import replace
from typing import Any

from hypothesis import strategies as st

from regrasp.trees import Node, NodeStats
from regrasp.trees.graph import NodePort

TEXTS = st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cs", "Zl", "Zp"]), max_size=80)
_PORT = st.builds(
    NodePort, name=st.sampled_from(["ticks", "a_long_name_of_a_port"]), value=TEXTS, constant=TEXTS | st.none()
)
_STATS = st.builds(NodeStats, *[st.integers(0, 9)] * 4, st.floats(0, 1e4)) | st.none()
_FIELDS: dict[str, Any] = {
    "name": st.from_regex(r"[\w-]{1,60}", fullmatch=True),
    "type": st.just("Some"),
    "memory": st.none() | st.booleans(),
    "ports": st.lists(_PORT, max_size=3).map(tuple),
    "hidden": st.integers(0, 20),
    "stats": _STATS,
    "failed": st.booleans(),
}


def _node(kinds: list[str], children: st.SearchStrategy[tuple[Node, ...]]) -> st.SearchStrategy[Node]:
    return st.builds(Node, path=st.just(""), kind=st.sampled_from(kinds), children=children, **_FIELDS)


def _inner(nodes: st.SearchStrategy[Node]) -> st.SearchStrategy[Node]:
    many = st.lists(nodes, min_size=1, max_size=5).map(tuple)
    one = nodes.map(lambda node: (node,))
    return _node(["sequence", "fallback", "parallel"], many) | _node(["decorator", "subtree"], one)


def _with_paths(node: Node, path: str = "n") -> Node:
    children = (_with_paths(child, f"{path}/{i}") for i, child in enumerate(node.children))
    return replace(node, path=path, children=tuple(children))


nodes = st.recursive(_node(["action", "condition"], st.just(())), _inner, max_leaves=30).map(_with_paths)
