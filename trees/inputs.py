"""What a tree file takes from outside: the defaults of its main tree, which a scenario may replace."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from regrasp.trees.check import Finding, check_runs, unknown
from regrasp.trees.element import TreeSyntaxError, read_elements
from regrasp.trees.vocabulary import Names, kinds
from regrasp.trees.wiring import TooLarge


def check_inputs(
    path: Path, inputs: Mapping[str, str], leaves: Mapping[str, type] | None = None, names: Names | None = None
) -> Iterator[tuple[str, str]]:
    """Key and sentence for every input that a tree file does not take, and for all that is wrong only with its value.

    What `check_tree` finds without the inputs is not told again; a file that it cannot read at all gives nothing.
    `leaves` and `names` as in `check_tree`.
    """
    if leaves is None:
        from regrasp.behaviors import LEAVES  # late, as in `check_tree`

        leaves = LEAVES
    try:
        root = read_elements(path)
    except (OSError, TreeSyntaxError):
        return
    trees = {tree.attributes.get("ID", ""): tree for tree in root.children if tree.tag == "BehaviorTree"}
    main = trees.get(root.attributes.get("main_tree_to_execute", ""))
    if main is None:
        return
    known = kinds(leaves, names)

    def found() -> list[Finding]:
        try:
            return check_runs(root, trees, known)
        except TooLarge:
            return []

    alone = now = found()
    blamed: dict[Finding, str] = {}  # the input whose value brings it
    for key, value in inputs.items():
        if key == "ID" or key not in main.attributes:
            yield key, unknown("input", key, main.attributes.keys() - {"ID"})
            continue
        main.attributes[key] = value
        before, now = now, found()
        blamed |= dict.fromkeys((finding for finding in now if finding not in before), key)
    yield from ((blamed[finding], finding[1]) for finding in dict.fromkeys(now) if finding not in alone)
