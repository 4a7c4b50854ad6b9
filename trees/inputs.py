"""Inputs of a tree file: the default values of its main tree's keys, which a scenario may replace."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from regrasp.trees.check import TreeFinding, check_runs, unknown
from regrasp.trees.element import TreeSyntaxError, read_elements
from regrasp.trees.leaf_sets import installed_leaves
from regrasp.trees.vocabulary import CellNames, element_kinds
from regrasp.trees.wiring import TreeTooLarge


def check_inputs(
    path: Path, inputs: Mapping[str, str], leaves: Mapping[str, type] | None = None, names: CellNames | None = None
) -> Iterator[tuple[str, str]]:
    """Key and message for every input that the tree does not take, or whose value causes a finding.

    Findings that `check_tree` has without the inputs are not repeated; a file that cannot be read gives none. `leaves`
    and `names` as in `check_tree`.
    """
    try:
        root = read_elements(path)
    except (OSError, TreeSyntaxError):
        return
    trees = {tree.attributes.get("ID", ""): tree for tree in root.children if tree.tag == "BehaviorTree"}
    main = trees.get(root.attributes.get("main_tree_to_execute", ""))
    if main is None:
        return
    known = element_kinds(installed_leaves(root) if leaves is None else leaves, names)

    def found() -> list[TreeFinding]:
        try:
            return check_runs(root, trees, known)
        except TreeTooLarge:
            return []

    alone = now = found()
    blamed: dict[TreeFinding, str] = {}  # the input whose value causes it
    for key, value in inputs.items():
        if key == "ID" or key not in main.attributes:
            yield key, unknown("input", key, main.attributes.keys() - {"ID"})
            continue
        main.attributes[key] = value
        before, now = now, found()
        blamed |= dict.fromkeys((finding for finding in now if finding not in before), key)
    yield from ((blamed[finding], finding[1]) for finding in dict.fromkeys(now) if finding not in alone)
