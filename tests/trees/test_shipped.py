"""Every tree that we ship is sound. (pytest tries each out by itself, on scripted leaves: app/pytest_plugin.py.)"""

from pathlib import Path

import py_trees
import pytest

from regrasp import trees
from regrasp.trees import check_tree, load_tree, node_paths, show_tree

SHIPPED = sorted(Path(trees.__file__).parent.glob("*.xml"))

every_tree = pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)


@every_tree
def test_a_shipped_tree_is_clean_loads_and_is_shown_in_full(path: Path) -> None:
    from regrasp.behaviors import LEAVES

    assert check_tree(path) == []
    root = load_tree(path, LEAVES)
    py_trees.blackboard.Blackboard.clear()
    paths = list(node_paths(root).values())
    assert len(set(paths)) == len(paths)
    shown = show_tree(path).splitlines()
    assert len(shown) == len(paths) + sum("  SubTree " in line for line in shown)


WRONG = {
    "a period of no time": ('period="0.1"', 'period="-1"', "period='-1' is not above 0; write more than 0"),
    "no time for the search": ('time_limit="300.0"', 'time_limit="0"', "time_limit='0' is not above 0"),
    "no such socket": ('"plugged_into"', '"back_44"', "is 'back_44' here, which is unknown; did you mean 'back_4'?"),
    "an empty socket": (
        '"plugged_into"',
        '"back_3"',
        "Unplug 'unplug': socket={socket} is 'back_3' here, which is empty",
    ),
    "a watch that would succeed": (
        '<Monitor name="monitor" period="0.1"/>',
        '<DetectSlip name="first"/><Monitor name="monitor" period="0.1"/>',
        "Monitor 'monitor' is never reached: DetectSlip 'first' before it never succeeds",
    ),
    "a fallback's watch": (
        '<Sequence name="watch" memory="false">',
        '<Fallback name="watch" memory="false">',
        "DetectSlip 'detect_slip' is never reached: Monitor 'monitor' before it never fails",
    ),
    "both of carry and watch": (
        '"success_on_one"',
        '"success_on_all"',
        "Parallel 'watched' can never succeed with success_on_all: Sequence 'watch' never does",
    ),
}


@pytest.mark.parametrize(("old", "new", "sentence"), WRONG.values(), ids=WRONG.keys())
def test_what_our_leaves_declare_is_enforced(tmp_path: Path, old: str, new: str, sentence: str) -> None:
    text = (Path(trees.__file__).parent / "recovery.xml").read_text()
    assert old in text
    text = text.replace(old, new)
    if "Fallback" in new:
        text = text.replace('slip"/>\n        </Sequence>', 'slip"/>\n        </Fallback>')
    (tmp_path / "tree.xml").write_text(text)
    (_, told), *_ = check_tree(
        tmp_path / "tree.xml", names={"socket": {"plugged_into": "", "back_3": "is empty", "back_4": ""}}
    )
    assert sentence in told
