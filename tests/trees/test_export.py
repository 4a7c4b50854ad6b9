"""What other programs read: the text is theirs, whatever stands in names and ports."""

import json
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import pydot
import pytest
from hypothesis import given, settings
from random_nodes import nodes
from test_golden import features, features_with_run

from regrasp import trees
from regrasp.app.files.resources import shipped
from regrasp.trees import Node, read_graph
from regrasp.trees.export import FORMAT_OF_SUFFIX, FORMATS, export_tree

# BehaviorTree.CPP's own nodes that we write; all others must be in the model.
BUILT_IN = {
    *("Sequence", "ReactiveSequence", "Fallback", "ReactiveFallback", "Parallel", "RetryUntilSuccessful", "Repeat"),
    *("Inverter", "ForceSuccess", "ForceFailure", "RunOnce"),
}


def groot(node: Node) -> ET.Element:
    return ET.fromstring(export_tree(node, "groot"))


@pytest.mark.parametrize("node", [features(), read_graph(Path(trees.__file__).with_name("recovery.xml"))])
def test_groot_knows_every_element_attribute_and_tree(node: Node) -> None:
    root = groot(node)
    model = {entry.attrib["ID"]: entry for entry in root.find("TreeNodesModel") or []}
    bodies = {tree.attrib["ID"]: tree for tree in root.findall("BehaviorTree")}
    assert root.attrib == {"BTCPP_format": "4", "main_tree_to_execute": next(iter(bodies))}
    for tree in bodies.values():
        assert len(tree) == 1
        for element in list(tree.iter())[1:]:
            if element.tag == "SubTree":
                assert element.attrib["ID"] in bodies
            entry = model.get(element.attrib["ID"] if element.tag == "SubTree" else element.tag)
            assert entry is not None or element.tag in BUILT_IN, element.tag
            if entry is not None:
                assert set(element.attrib) - {"ID", "name"} <= {port.attrib["name"] for port in entry}


def test_groot_s_words_for_memory_policy_and_decorators() -> None:
    by_name = {e.get("name"): e for e in groot(features()).iter()}
    words = {"root": "Sequence", "look_about": "ReactiveSequence", "again": "Fallback", "either": "ReactiveFallback"}
    assert {name: by_name[name].tag for name in words} == words
    assert by_name["carry"].attrib == {"name": "carry", "success_count": "1", "failure_count": "1"}
    assert by_name["both"].attrib["success_count"] == "-1"
    assert by_name["retry"].attrib["num_attempts"] == "{tries}"
    assert by_name["search"].attrib["tries"] == "3"  # a default of the main tree, written out
    assert "tries" not in by_name["search_again"].attrib  # the model has the default


def test_groot_gets_a_run_as_descriptions_of_each_instance() -> None:
    by_name = {e.get("name"): e for e in groot(features_with_run()).iter()}
    assert "root/search/retry: 1 visit" in by_name["retry"].attrib["_description"]
    assert "root/again/search_again/retry: not visited" in by_name["retry"].attrib["_description"]


@given(nodes)
@settings(max_examples=50)
def test_groot_is_xml_whatever_stands_in_the_ports(node: Node) -> None:
    # Each subtree is a tree of its own here, since they differ.
    root = groot(_own_subtrees(node))
    subtrees = sum(n.kind == "subtree" for n in node.walk())
    assert len(root.findall("BehaviorTree")) == 1 + subtrees
    assert sum(e.get("name") is not None and e.tag[-5:] != "_port" for e in root.iter()) == sum(1 for _ in node.walk())


def _own_subtrees(node: Node) -> Node:
    subtree = node.path if node.kind == "subtree" else ""
    children = tuple(_own_subtrees(child) for child in node.children)
    return replace(node, tree="Main", subtree=subtree, policy="", children=children)


@pytest.mark.filterwarnings("ignore::DeprecationWarning:pydot.dot_parser")
@given(nodes)
@settings(max_examples=25)
def test_dot_is_read_by_a_dot_parser(node: Node) -> None:
    parsed = pydot.graph_from_dot_data(export_tree(node, "dot").decode())
    assert parsed is not None
    (graph,) = parsed
    links = sum(len(n.children) for n in node.walk() if n.kind != "subtree")
    assert len(graph.get_edges()) == links


@given(nodes)
def test_mermaid_has_a_line_for_each_node_and_no_character_that_ends_a_label(node: Node) -> None:
    lines = export_tree(node, "mermaid").decode().splitlines()
    labels = [line for line in lines if '"' in line]
    assert len(labels) == sum(1 for _ in node.walk())
    assert all(line.count('"') == 2 and not set("`\\") & set(line) for line in labels)


@given(nodes)
def test_json_and_ascii_tell_every_node(node: Node) -> None:
    value = json.loads(export_tree(node, "json"))
    todo, paths = [value["tree"]], []
    while todo:
        current = todo.pop()
        paths.append(current["path"])
        todo += current["children"]
    assert sorted(paths) == sorted(n.path for n in node.walk())
    assert len(export_tree(node, "ascii").decode().rstrip("\n").split("\n")) == len(paths)


def test_every_format_has_an_ending() -> None:
    assert set(FORMAT_OF_SUFFIX.values()) == set(FORMATS)


def test_a_composite_that_is_not_built_in_is_a_control_node() -> None:
    """Groot2 refuses a decorator with several children."""
    graph = read_graph(shipped("tree")["printer_part"])
    (node,) = (node for node in graph.walk() if node.type == "DoTask")
    assert node.kind == "control"
    model = ET.fromstring(export_tree(graph, "groot")).find("TreeNodesModel")
    assert model is not None
    assert [entry.get("ID") for entry in model.findall("Control")] == ["DoTask"]
    assert b"control" in export_tree(graph, "svg")
