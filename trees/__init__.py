"""Loads, checks, shows and exports tree files."""

from regrasp.trees.check import TreeFinding, check_tree
from regrasp.trees.element import TreeSyntaxError
from regrasp.trees.graph import Node, collapsed, read_graph, recorded
from regrasp.trees.inputs import check_inputs
from regrasp.trees.load import TreeError, load_tree
from regrasp.trees.paths import in_tree_order, node_paths
from regrasp.trees.run_stats import NodeExecution, NodeStats, executions, run_stats
from regrasp.trees.show import show_tree

__all__ = [
    "Node",
    "NodeExecution",
    "NodeStats",
    "TreeError",
    "TreeFinding",
    "TreeSyntaxError",
    "check_inputs",
    "check_tree",
    "collapsed",
    "executions",
    "in_tree_order",
    "load_tree",
    "node_paths",
    "read_graph",
    "recorded",
    "run_stats",
    "show_tree",
]
