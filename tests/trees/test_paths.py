from pathlib import Path

import py_trees
from toy_leaves import GOOD, LEAVES

from regrasp.trees import in_tree_order, load_tree, node_paths


def test_paths_hold_subtree_names_and_follow_tree_order(tmp_path: Path) -> None:
    (tmp_path / "tree.xml").write_text(GOOD)
    root = load_tree(tmp_path / "tree.xml", LEAVES)
    assert list(node_paths(root).values()) == [
        "root",
        "root/search/again",
        "root/search/again/either",
        "root/search/again/either/not_yet",
        "root/search/again/either/not_yet/blink",
        "root/search/again/either/look",
        "root/carry",
        "root/carry/watch",
        "root/carry/move",
        "root/go",
    ]


def test_trees_built_by_hand_have_unique_paths_too() -> None:
    leaves = [py_trees.behaviours.Success(name) for name in ("look", "look", "look#2")]
    root = py_trees.composites.Sequence("root", memory=True, children=leaves)
    assert list(node_paths(root).values()) == ["root", "root/look", "root/look#2", "root/look#2#2"]
    assert [node.name for node in in_tree_order(root)] == ["root", "look", "look", "look#2"]
