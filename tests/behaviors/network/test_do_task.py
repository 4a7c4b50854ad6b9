"""The node that does what was planned, in trees whose leaves are scripted."""

from pathlib import Path

import pytest

from regrasp.trees.scripted import ScriptedTree

NETWORK = """
description: A lamp that only a key switches.
goal: light
state:
  lamp: {values: [dark, lit], starts: dark}
  key: {values: [away, here], starts: away}
actions:
  fetch: {needs: {key: away}, gives: {key: here}}
  turn: {needs: {key: here}, gives: {lamp: lit}}
tasks:
  light:
    - {name: done_already, when: {lamp: lit}, do: []}
    - {name: key_is_here, when: {key: here}, do: [turn]}
    - {name: from_the_start, do: [fetch, turn]}
"""
TREE = """
<root main_tree_to_execute="Main">
  <BehaviorTree ID="Main">
    <DoTask name="job" network="lamp.yaml" replans="3">
      <StartUp name="fetch"/>
      <SubTree ID="Turn" name="turn"/>
    </DoTask>
  </BehaviorTree>
  <BehaviorTree ID="Turn"><StartUp name="it"/></BehaviorTree>
</root>
"""


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    (tmp_path / "lamp.yaml").write_text(NETWORK)
    path = tmp_path / "lamp.xml"
    path.write_text(TREE)
    return path


def entered(run: ScriptedTree) -> dict[str, int]:
    return {path: leaf.entered for path, leaf in run.leaves.items()}


def test_it_ticks_the_child_of_each_action_in_the_plan_s_order(tree: Path) -> None:
    #             1        2        3        4
    # fetch       RUNNING  SUCCESS
    # turn                          SUCCESS
    # job         RUNNING  RUNNING  RUNNING  SUCCESS
    run = ScriptedTree(tree, {"job/fetch": "2 success"})
    assert run.run() == run.status.SUCCESS
    assert run.ticks == 4
    assert entered(run) == {"job/fetch": 1, "job/turn/it": 1}


def test_after_a_failure_it_plans_again_and_does_not_repeat_what_is_done(tree: Path) -> None:
    run = ScriptedTree(tree, {"job/turn/it": "failure, failure, success"})
    assert run.run() == run.status.SUCCESS
    assert entered(run) == {"job/fetch": 1, "job/turn/it": 3}


def test_it_plans_again_a_bounded_number_of_times(tree: Path) -> None:
    run = ScriptedTree(tree, {"job/fetch": "failure"})
    assert run.run() == run.status.FAILURE
    assert entered(run) == {"job/fetch": 4, "job/turn/it": 0}


@pytest.mark.parametrize(
    ("fetch", "turn", "entered_turn"),
    [("success", "failure", 2), ("success", "failure, success", 2), ("failure, success", "failure", 2)],
)
def test_an_action_that_fails_as_often_as_its_tries_ends_the_task(
    tree: Path, fetch: str, turn: str, entered_turn: int
) -> None:
    lamp = tree.with_name("lamp.yaml")
    lamp.write_text(lamp.read_text().replace("gives: {lamp: lit}", "gives: {lamp: lit}, tries: 2"))
    run = ScriptedTree(tree, {"job/fetch": fetch, "job/turn/it": turn})
    assert run.run() == (run.status.SUCCESS if "success" in turn else run.status.FAILURE)
    assert entered(run) == {"job/fetch": len(fetch.split(",")), "job/turn/it": entered_turn}


def test_what_other_actions_do_in_between_gives_an_action_no_more_tries(
    tree: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lamp = tree.with_name("lamp.yaml")
    lamp.write_text(lamp.read_text().replace("gives: {lamp: lit}", "gives: {lamp: lit}, tries: 2"))
    run = ScriptedTree(tree, {"job/turn/it": "failure"})
    (job,) = (node for node in run.tree.root.iterate() if node.name == "job")
    # The key is gone whenever the switch was tried, and is fetched again.
    monkeypatch.setattr(job.services, "seen", lambda _: {"key": "away"} if job._why.startswith("turn") else {})
    assert run.run() == run.status.FAILURE
    assert entered(run) == {"job/fetch": 2, "job/turn/it": 2}


def test_where_the_robot_sees_that_the_plan_is_void_it_plans_again(tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = ScriptedTree(tree)
    (job,) = (node for node in run.tree.root.iterate() if node.name == "job")
    seen = iter([{}, {"key": "away"}, {}, {}, {}, {}])  # the key is gone again after it was fetched
    monkeypatch.setattr(job.services, "seen", lambda state: next(seen))
    assert run.run() == run.status.SUCCESS
    assert entered(run) == {"job/fetch": 2, "job/turn/it": 1}


def test_what_the_robot_sees_and_the_network_does_not_ask_for_is_left_out(
    tree: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = ScriptedTree(tree)
    (job,) = (node for node in run.tree.root.iterate() if node.name == "job")
    monkeypatch.setattr(job.services, "seen", lambda state: {"weather": "fine", "key": "in_the_sea", "lamp": "lit"})
    assert run.run() == run.status.SUCCESS
    assert run.ticks == 1
    assert entered(run) == {"job/fetch": 0, "job/turn/it": 0}


def test_a_stop_stops_the_child_that_runs(tree: Path) -> None:
    run = ScriptedTree(tree, {"job/fetch": "5 success"})
    run.cancel_at(2)
    assert run.leaves["job/fetch"].stopped == 1
    assert run.running == []
