from pathlib import Path

import py_trees
import pytest
from fake_services import Stage
from py_trees.common import Status

from regrasp.behaviors import LEAVES
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cause import CauseCode
from regrasp.trees.check import check_tree
from regrasp.trees.load import load_tree

BOTH = (
    '<Sequence name="s" memory="true"><SetKey name="set" value="careful" key="{mode}"/>'
    '<CheckKey name="check" key="{mode}" equals="EQUALS"/></Sequence>'
)


@pytest.mark.parametrize(("text", "status"), [("careful", Status.SUCCESS), ("quick", Status.FAILURE)])
def test_a_key_is_what_was_set(known: CableKnown, tmp_path: Path, text: str, status: Status) -> None:
    stage = Stage(known, tmp_path)
    assert stage.run(stage.tree(BOTH.replace("EQUALS", text)), 1.0) is status
    told = [(cause.code, cause.message, cause.node) for cause in stage.causes]
    why = (CauseCode.KEY_DIFFERS, "the key holds 'careful', not 'quick'", "s/check")
    assert told == ([] if status is Status.SUCCESS else [why])


@pytest.mark.parametrize(("given", "status"), [({}, Status.FAILURE), ({"mode": "quick"}, Status.SUCCESS)])
def test_a_tree_goes_another_way_by_its_input(
    known: CableKnown, tmp_path: Path, given: dict[str, str], status: Status
) -> None:
    stage, path = Stage(known, tmp_path), tmp_path / "tree.xml"
    check = '<CheckKey name="check" key="{mode}" equals="quick"/>'
    path.write_text(f'<root main_tree_to_execute="M"><BehaviorTree ID="M" mode="careful">{check}</BehaviorTree></root>')
    tree = py_trees.trees.BehaviourTree(load_tree(path, LEAVES, given))
    tree.setup(services=stage.services)
    assert stage.run(tree, 1.0) is status


def test_a_key_that_nothing_sets_is_a_finding(tmp_path: Path) -> None:
    path = tmp_path / "tree.xml"
    check = '<CheckKey name="check" key="{mode}" equals="quick"/>'
    path.write_text(f'<root main_tree_to_execute="M"><BehaviorTree ID="M">\n{check}</BehaviorTree></root>')
    [(line, message)] = check_tree(path, LEAVES)
    assert line == 2
    assert "reads" in message
    assert "which no port writes" in message
