from pathlib import Path

import py_trees
import pytest
from toy_leaves import GOOD, LEAVES

from app.resources import shipped
from behaviors import LEAVES as OURS
from trees import TreeSyntaxError, load_tree, node_paths
from trees.outline import outline


@pytest.mark.parametrize("name", ["good", *shipped("tree")])
def test_it_names_the_nodes_as_the_loaded_tree_does(tmp_path: Path, name: str) -> None:
    path = shipped("tree").get(name, tmp_path / "good.xml")
    if name == "good":
        path.write_text(GOOD)
    root: py_trees.behaviour.Behaviour = load_tree(path, LEAVES if name == "good" else OURS)
    assert [node.path for node in outline(path)] == [*node_paths(root).values()]


def test_type_and_depth(tmp_path: Path) -> None:
    (tmp_path / "good.xml").write_text(GOOD)
    nodes = {node.path: node for node in outline(tmp_path / "good.xml")}
    assert (nodes["root"].type, nodes["root"].depth) == ("Sequence", 0)
    assert (nodes["root/search/again"].type, nodes["root/search/again"].depth) == ("Retry", 1)


@pytest.mark.parametrize(
    ("text", "error"),
    [
        (
            '<root main_tree_to_execute="A"><BehaviorTree ID="A"><SubTree ID="A" name="a"/></BehaviorTree></root>',
            ValueError,
        ),
        (
            '<root main_tree_to_execute="A"><BehaviorTree ID="A"><Sequence name="s"><SubTree ID="A" name="a"/>'
            '<SubTree ID="A" name="b"/></Sequence></BehaviorTree></root>',
            ValueError,
        ),
        ("<root", TreeSyntaxError),
    ],
)
def test_what_has_no_end_is_an_error(tmp_path: Path, text: str, error: type[Exception]) -> None:
    (tmp_path / "bad.xml").write_text(text)
    with pytest.raises(error):
        outline(tmp_path / "bad.xml")
