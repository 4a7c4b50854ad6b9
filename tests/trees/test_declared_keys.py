"""The keys that leaf classes declare, in the check of a tree file, on scripted leaves and in the catalogue."""

from collections.abc import Iterator
from pathlib import Path

import py_trees
import pytest
from py_trees.common import Status
from toy_leaves import GRASPS, KEY_LEAVES, LEAVES, WIDTH

from regrasp.behaviors.keys import value_of
from regrasp.trees import check_inputs, check_tree, load_tree
from regrasp.trees.catalogue import all_elements, describe
from regrasp.trees.scripted import ScriptedTree

ALL = LEAVES | KEY_LEAVES
NEEDS = "'pull' needs toy/width (width of what the hand holds, m), which nothing "


@pytest.fixture(autouse=True)
def _clear_blackboard() -> Iterator[None]:
    yield
    py_trees.blackboard.Blackboard.clear()


def written(tmp_path: Path, *lines: str, control: str = "Sequence") -> Path:
    """A tree file with a Sequence on line 1 and a child on each line from 2."""
    body = "\n".join([f'<{control} name="s" memory="true">', *lines])
    path = tmp_path / "tree.xml"
    path.write_text(
        f'<root main_tree_to_execute="M"><BehaviorTree ID="M" x="1">{body}\n</{control}></BehaviorTree></root>'
    )
    return path


def check(tmp_path: Path, *lines: str, control: str = "Sequence") -> list[tuple[int, str]]:
    return [
        (line, sentence)
        for line, sentence in check_tree(written(tmp_path, *lines, control=control), ALL)
        if "default of a key" not in sentence
    ]


PULL, GRIP, DROP, REGRIP = '<Pull name="pull"/>', '<Grip name="grip"/>', '<Drop name="drop"/>', '<Regrip name="re"/>'


def test_a_key_that_nothing_writes_is_a_finding_that_names_the_leaves_which_do(tmp_path: Path) -> None:
    assert check(tmp_path, PULL) == [
        (2, f"Pull {NEEDS}in this tree writes; tick Grip or Drop before it"),
    ]


def test_a_key_that_no_leaf_writes_is_a_finding(tmp_path: Path) -> None:
    [(line, sentence)] = check_tree(written(tmp_path, PULL), {"Pull": KEY_LEAVES["Pull"]})[1:]
    assert (line, sentence) == (2, f"Pull {NEEDS}in this tree writes; no leaf that is known does, so remove it")


def test_a_key_that_is_needed_too_early_is_a_finding_that_names_the_writer(tmp_path: Path) -> None:
    early = f"Pull {NEEDS}can have written before it; tick Grip 'grip' of line 3 before it"
    assert check(tmp_path, PULL, GRIP) == [(2, early)]
    assert check(tmp_path, PULL, GRIP, control="Fallback")[0] == (2, early)


def test_a_key_that_may_have_been_written_is_no_finding(tmp_path: Path) -> None:
    either = f'<Fallback name="f" memory="true"><Inverter name="i">{PULL}</Inverter>{DROP}</Fallback>'
    for lines in ([GRIP, PULL], [GRIP, either], [GRIP, DROP, PULL], [GRIP, REGRIP], ['<Grip name="a"/>', GRIP]):
        assert check(tmp_path, *lines) == []


def test_what_a_leaf_writes_itself_is_no_help_to_it(tmp_path: Path) -> None:
    [(line, sentence)] = check(tmp_path, REGRIP)
    assert line == 2
    assert "in this tree writes; tick Grip or Drop before it" in sentence


def test_a_key_with_a_default_needs_no_writer(tmp_path: Path) -> None:
    assert KEY_LEAVES["Grip"].READS == (GRASPS,)
    assert check(tmp_path, GRIP) == []


def test_a_misspelt_writer_is_one_finding(tmp_path: Path) -> None:
    [(line, sentence)] = check(tmp_path, '<Gripp name="grip"/>', PULL)
    assert (line, sentence) == (2, "unknown element 'Gripp'; did you mean 'Grip'?")


def test_a_key_is_one_in_every_subtree(tmp_path: Path) -> None:
    inner = f'<BehaviorTree ID="In">{PULL}</BehaviorTree></root>'
    call = '<SubTree ID="In" name="in"/>'
    path = written(tmp_path, GRIP, call)
    path.write_text(path.read_text().replace("</root>", inner))
    assert [s for _, s in check_tree(path, ALL) if "Pull" in s] == []
    path = written(tmp_path, call, GRIP)
    path.write_text(path.read_text().replace("</root>", inner))
    [(line, sentence)] = [(line, s) for line, s in check_tree(path, ALL) if "Pull" in s]
    assert line == 4
    assert "tick Grip 'grip' of line 3 before it" in sentence


def test_a_leaf_that_needs_a_key_may_fail_whatever_it_declares(tmp_path: Path) -> None:
    either = f'<Fallback name="f" memory="true">{REGRIP}<Wait name="w" ticks="1"/></Fallback>'
    assert check(tmp_path, GRIP, either) == []


def test_the_finding_of_a_key_is_not_blamed_on_an_input(tmp_path: Path) -> None:
    path = written(tmp_path, PULL, '<Wait name="w" ticks="{x}"/>')
    assert [*check_inputs(path, {"x": "2"}, ALL)] == []
    assert [key for key, _ in check_inputs(path, {"x": "two"}, ALL)] == ["x"]


def test_a_loaded_tree_hands_values_on_by_declared_keys(tmp_path: Path) -> None:
    path = written(tmp_path, GRIP, PULL, DROP, '<Grip name="again"/>', '<Drop name="drop_2"/>')
    path.write_text(path.read_text().replace(' x="1"', ""))
    tree = py_trees.trees.BehaviourTree(load_tree(path, ALL))
    tree.setup()
    tree.tick()
    assert tree.root.status is Status.SUCCESS
    assert (value_of(WIDTH, None), value_of(GRASPS)) == (None, 2)
    names = {client.name for node in tree.root.children for client in node.blackboards if WIDTH.path in client.write}
    assert names == {f"s.{name} keys" for name in ("grip", "drop", "again", "drop_2")}
    assert len(py_trees.blackboard.Blackboard.metadata[WIDTH.path].read) == 1


def test_scripted_leaves_keep_the_declared_keys_and_write_nothing(tmp_path: Path) -> None:
    path = written(tmp_path, GRIP, PULL)
    path.write_text(path.read_text().replace(' x="1"', ""))
    tree = ScriptedTree(path, {"Pull": "2 success"}, leaves=ALL)
    assert tree.run() is Status.SUCCESS
    assert value_of(WIDTH, None) is None
    with pytest.raises(ValueError, match="needs toy/width"):
        ScriptedTree(written(tmp_path, PULL), leaves=ALL)


def test_the_catalogue_tells_the_keys(tmp_path: Path) -> None:
    lines = [*describe("Grip", all_elements(ALL)["Grip"])]
    assert lines == [
        "Grip               Takes hold of something.",
        "    toy/grasps     reads: grasps so far",
        "    toy/width      writes: width of what the hand holds, m",
        "    toy/grasps     writes: grasps so far",
    ]
    from regrasp.behaviors.common import LEAVES as COMMON

    assert not [line for line in describe("Log", all_elements(COMMON)["Log"]) if "causes" in line]
