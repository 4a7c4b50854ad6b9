from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_nodes import nodes
from test_golden import CHAIN, FEATURES, features, features_with_run
from toy_leaves import LEAVES

from regrasp.trees import Node, collapsed, load_tree, node_paths, read_graph, run_stats


def by_path(root: Node) -> dict[str, Node]:
    return {node.path: node for node in root.walk()}


def test_nodes_are_those_of_the_loaded_tree_and_its_subtrees() -> None:
    loaded = load_tree(FEATURES, LEAVES)
    read = [node for node in features().walk() if node.kind != "subtree"]
    assert [node.path for node in read] == list(node_paths(loaded).values())


def test_constants_are_followed_through_subtrees_and_inputs_take_the_place_of_defaults() -> None:
    root = by_path(features())
    assert root["root/search/retry"].ports[0].text == "num_failures={tries}=3"
    assert root["root/again/search_again/retry"].ports[0].text == "num_failures={tries}=9"
    assert root["root/carry/twice/move"].ports[0].text == "place={place}"
    given = by_path(read_graph(FEATURES, LEAVES, {"attempts": "4"}))
    assert given["root/search/retry"].ports[0].text == "num_failures={tries}=4"


def test_keys_of_a_subtree_have_the_type_and_direction_of_what_they_are_wired_to() -> None:
    ports = {port.name: port for port in by_path(features())["root/search"].ports}
    assert (ports["place"].direction, ports["place"].type) == ("output", "float")
    assert (ports["tries"].direction, ports["tries"].type, ports["tries"].default) == ("input", "int", "9")


def test_a_leaf_that_answers_at_once_is_a_condition() -> None:
    assert {node.name for node in features().walk() if node.kind == "condition"} == {"seen"}


@given(nodes, st.integers(0, 3))
def test_subtrees_below_the_depth_are_closed_and_what_is_in_them_is_counted(node: Node, depth: int) -> None:
    plain, cut = by_path(node), by_path(collapsed(node, depth))
    subtrees = {path for path, n in plain.items() if n.kind == "subtree"}
    for path, n in plain.items():
        around = [s for s in subtrees if path.startswith(f"{s}/")]
        assert (path in cut) == (len(around) <= depth)
        if path in subtrees and len(around) == depth:
            assert cut[path] == replace(n, children=(), hidden=sum(m.kind != "subtree" for m in n.walk()))


def test_a_run_s_stats_and_failed_path_are_on_the_nodes_and_on_the_subtrees_round_them() -> None:
    root = by_path(features_with_run())
    assert {path for path, node in root.items() if node.failed} == CHAIN
    assert root["root/search"].stats == root["root/search/retry"].stats
    assert root["root/again/search_again"].unvisited
    assert not by_path(features())["root"].unvisited


def test_visits_results_stops_and_seconds_are_counted_from_changes() -> None:
    changes = [
        (0.5, "a", "RUNNING"),
        (1.0, "b", "FAILURE"),
        (1.5, "b", "RUNNING"),
        (2.0, "a", "INVALID"),
        (2.0, "c", "INVALID"),
        (3.0, "b", "SUCCESS"),
        (3.0, "a", "RUNNING"),
        (4.0, "b", "FAILURE"),
    ]
    stats = run_stats(changes)
    assert stats["a"].text == "2 visits, 1 stopped, 2.50 s"  # and runs on
    assert stats["b"].text == "3 visits, 1 ok, 2 failed, 1.50 s"
    assert "c" not in stats
    assert [stats[path].last for path in "ab"] == ["RUNNING", "FAILURE"]


def test_a_file_without_a_main_tree_is_refused(tmp_path: Path) -> None:
    (tmp_path / "tree.xml").write_text('<root main_tree_to_execute="No"><BehaviorTree ID="Yes"/></root>')
    with pytest.raises(ValueError, match="no tree 'No'"):
        read_graph(tmp_path / "tree.xml", LEAVES)


def test_subtrees_that_multiply_without_end_are_refused(tmp_path: Path) -> None:
    twice = (
        '<BehaviorTree ID="T{}"><Sequence name="s">'
        + '<SubTree ID="T{}" name="{}"/>' * 2
        + "</Sequence></BehaviorTree>"
    )
    trees = "".join(twice.format(i, i + 1, "a", i + 1, "b") for i in range(40))
    (tmp_path / "tree.xml").write_text(f'<root main_tree_to_execute="T0">{trees}</root>')
    with pytest.raises(ValueError, match="more than 2000 nodes"):
        read_graph(tmp_path / "tree.xml", LEAVES)
