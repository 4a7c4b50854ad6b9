from collections.abc import Iterator
from pathlib import Path

import py_trees
import pytest
from py_trees.common import Status
from toy_leaves import GOOD, LEAVES

from regrasp.trees import TreeError, load_tree, node_paths


@pytest.fixture(autouse=True)
def _clear_blackboard() -> Iterator[None]:
    yield
    py_trees.blackboard.Blackboard.clear()


def test_a_loaded_tree_ticks_and_hands_values_through_a_subtree(tmp_path: Path) -> None:
    (tmp_path / "tree.xml").write_text(GOOD)
    root = load_tree(tmp_path / "tree.xml", LEAVES)
    tree = py_trees.trees.BehaviourTree(root)
    tree.setup(services="the services")
    nodes = {path: node for node in root.iterate() for path in [node_paths(root)[node.id]]}
    assert nodes["root/carry/move"].services == {"services": "the services"}
    assert nodes["root/search/again"].num_failures == 2

    # tick | search  | carry   | root
    #   1  | SUCCESS | RUNNING | RUNNING
    #   2  | SUCCESS | SUCCESS | SUCCESS
    tree.tick()
    assert [nodes[p].status for p in ("root/search/again", "root/carry", "root")] == [
        Status.SUCCESS,
        Status.RUNNING,
        Status.RUNNING,
    ]
    tree.tick()
    assert root.status is Status.SUCCESS
    assert nodes["root/go"].went_to == 0.5


def test_a_wrong_tree_is_refused_with_every_finding_at_file_and_line(tmp_path: Path) -> None:
    path = tmp_path / "wrong.xml"
    path.write_text(GOOD.replace("<Go ", "<Goo ").replace('ticks="99"', 'ticks="many"'))
    with pytest.raises(TreeError) as caught:
        load_tree(path, LEAVES)
    assert f"{path}:6: " in str(caught.value)
    assert f"{path}:9: unknown element 'Goo'; did you mean 'Go'?" in str(caught.value)
    assert len(caught.value.findings) == 2
