"""Every tree that we ship is sound."""

from pathlib import Path

import py_trees
import pytest

import trees
from trees import check_tree, load_tree, node_paths, show_tree

SHIPPED = sorted(Path(trees.__file__).parent.glob("*.xml"))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_a_shipped_tree_is_clean_loads_and_is_shown_in_full(path: Path) -> None:
    from behaviors import LEAVES

    assert check_tree(path) == []
    root = load_tree(path, LEAVES)
    py_trees.blackboard.Blackboard.clear()
    paths = list(node_paths(root).values())
    assert len(set(paths)) == len(paths)
    shown = show_tree(path).splitlines()
    assert len(shown) == len(paths) + sum("  SubTree " in line for line in shown)
