"""Tree files, and what loads and checks them."""

from trees.check import Finding, check_tree
from trees.element import TreeSyntaxError
from trees.inputs import check_inputs
from trees.load import TreeError, load_tree
from trees.paths import in_tree_order, node_paths
from trees.show import show_tree

__all__ = [
    "Finding",
    "TreeError",
    "TreeSyntaxError",
    "check_inputs",
    "check_tree",
    "in_tree_order",
    "load_tree",
    "node_paths",
    "show_tree",
]
