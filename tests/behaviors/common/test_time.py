from pathlib import Path

import pytest
from fake_services import Stage
from py_trees.common import Status

from regrasp.app.run.attempts import Attempts
from regrasp.behaviors import LEAVES
from regrasp.behaviors.keys import causes
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cause import CauseCode
from regrasp.trees.check import check_tree
from regrasp.trees.scripted import ScriptedTree

LIMITED = '<TimeLimit name="limit" seconds="{limit}"><Wait name="wait" seconds="{wait}"/></TimeLimit>'
TREE = '<root main_tree_to_execute="M"><BehaviorTree ID="M">{}</BehaviorTree></root>'


def test_wait_succeeds_after_so_many_simulated_seconds(known: CableKnown, tmp_path: Path) -> None:
    stage = Stage(known, tmp_path)
    tree = stage.tree('<Wait name="wait" seconds="0.5"/>')
    assert stage.run(tree, 0.4) is Status.RUNNING
    assert stage.run(tree, 1.0) is Status.SUCCESS
    assert stage.clock.t == pytest.approx(0.5)


def test_a_child_within_its_limit_keeps_its_status(known: CableKnown, tmp_path: Path) -> None:
    stage = Stage(known, tmp_path)
    assert stage.run(stage.tree(LIMITED.format(limit=0.5, wait=0.45)), 2.0) is Status.SUCCESS
    assert not stage.causes


def test_a_child_past_its_limit_is_stopped_and_the_limit_is_the_cause(known: CableKnown, tmp_path: Path) -> None:
    stage = Stage(known, tmp_path)
    tree = stage.tree(LIMITED.format(limit=0.5, wait=5.0))
    attempts = Attempts(tree.root, causes, stage.clock.now, {"limit": "TimeLimit"})
    tree.visitors.append(attempts)
    assert stage.run(tree, 2.0) is Status.FAILURE
    assert stage.clock.t == pytest.approx(0.5)
    assert tree.root.decorated.status is Status.INVALID
    [cause] = stage.causes
    assert (cause.code, cause.node) == (CauseCode.TIMED_OUT, "limit")
    assert cause.message == "wait still ran after 0.5 simulated seconds"
    assert attempts.cause() is cause
    [link] = attempts.failed_chain() or ()
    assert link.why == f"timed_out: {cause.message}"


def test_the_limit_counts_anew_when_it_is_entered_anew(known: CableKnown, tmp_path: Path) -> None:
    stage = Stage(known, tmp_path)
    body = LIMITED.format(limit=0.5, wait=5.0)
    assert stage.run(stage.tree(f'<Retry name="again" num_failures="3">{body}</Retry>'), 9.0) is Status.FAILURE
    assert stage.clock.t == pytest.approx(1.6, abs=0.06)
    assert len(stage.causes) == 3


def test_the_check_knows_that_a_limit_ends_what_runs_for_ever(tmp_path: Path) -> None:
    path, leaf = tmp_path / "tree.xml", '<Monitor name="monitor" period="0.1"/>'
    limit = f'<TimeLimit name="limit" seconds="1.0"><SuccessIsRunning name="on">{leaf}</SuccessIsRunning></TimeLimit>'
    for body, right in (
        (limit, True),
        (limit.replace("TimeLimit", "PassThrough").replace(' seconds="1.0"', ""), False),
    ):
        path.write_text(TREE.format(f'<Fallback name="f" memory="true">{body}<StartUp name="s"/></Fallback>'))
        assert (check_tree(path, LEAVES) == []) is right
    never = '<Fallback name="f" memory="true">{}<StartUp name="s"/></Fallback>'
    logged = '<TimeLimit name="limit" seconds="1.0"><Log name="log" message="x"/></TimeLimit>'
    path.write_text(TREE.format(never.format(logged)))
    [(_, message)] = check_tree(path, LEAVES)
    assert "is never reached" in message  # a Log ends at once, and never fails
    path.write_text(TREE.format(LIMITED.format(limit=0, wait=1)))
    [(_, message)] = check_tree(path, LEAVES)
    assert "seconds" in message
    assert "is not above 0; write more than 0" in message


def test_a_scripted_tree_keeps_the_limit_on_its_simulated_clock(tmp_path: Path) -> None:
    path = tmp_path / "tree.xml"
    path.write_text(TREE.format(LIMITED.format(limit=0.2, wait=5.0)))
    tree = ScriptedTree(path, {"Wait": "100 success"})
    assert tree.run() is Status.FAILURE
    assert tree.now() == pytest.approx(0.2)
    assert tree.leaves["limit/wait"].stopped == 1


def test_a_log_leaf_writes_its_message(known: CableKnown, tmp_path: Path) -> None:
    stage = Stage(known, tmp_path)
    assert stage.run(stage.tree('<Log name="log" message="half way"/>'), 1.0) is Status.SUCCESS
    assert stage.log.of("remark") == [{"node": "log", "message": "half way"}]
