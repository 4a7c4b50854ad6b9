"""Builds py_trees behaviours from a tree file."""

from collections.abc import Mapping
from pathlib import Path

import py_trees
from py_trees.parsers.behaviour_tree_xml import parse_behaviour_tree_xml

from regrasp.trees.check import TreeFinding, check_tree


class TreeError(ValueError):
    """A tree file with findings; the message names file and line of each."""

    def __init__(self, path: Path, findings: list[TreeFinding]) -> None:
        super().__init__("\n".join(f"{path}:{line}: {message}" for line, message in findings))
        self.findings = findings


def load_tree(
    path: Path, leaves: Mapping[str, type], inputs: Mapping[str, str] | None = None
) -> py_trees.behaviour.Behaviour:
    """Build the tree that the file describes; `leaves` maps a tag to its leaf class.

    `inputs` take the place of the main BehaviorTree's default values of the same keys.

    A node's name is its dotted path, names of subtrees included: root.search.look. Nothing is set up yet: hand the
    services to `py_trees.trees.BehaviourTree(root).setup(services=...)`.

    Raises:
        TreeError: the check has findings.
    """
    if findings := check_tree(path, leaves):
        raise TreeError(path, findings)
    return parse_behaviour_tree_xml(str(path), node_registry=dict(leaves), input_mappings=dict(inputs or {}))
