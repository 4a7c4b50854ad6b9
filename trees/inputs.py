"""What a tree file takes from outside: the defaults of its main tree, which a scenario may replace."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from trees.check import unknown
from trees.element import read_elements
from trees.vocabulary import Names, kinds
from trees.wiring import Filled


def check_inputs(
    path: Path, inputs: Mapping[str, str], leaves: Mapping[str, type] | None = None, names: Names | None = None
) -> Iterator[tuple[str, str]]:
    """Key and sentence for every input that a tree file without findings does not take, or not with this value.

    `leaves` and `names` as in `check_tree`.
    """
    if leaves is None:
        from behaviors import LEAVES  # late, as in `check_tree`

        leaves = LEAVES
    root = read_elements(path)
    trees = {tree.attributes["ID"]: tree for tree in root.children}
    main = trees[root.attributes["main_tree_to_execute"]]
    taken = main.attributes
    for key, value in inputs.items():
        if key == "ID" or key not in taken:
            yield key, unknown("input", key, taken.keys() - {"ID"})
            continue
        default, taken[key] = taken[key], value
        yield from ((key, message) for _, message in Filled(main, trees, kinds(leaves, names)).findings)
        taken[key] = default
