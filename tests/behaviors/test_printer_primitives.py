"""A tree of a user's own from the primitive actions, run to its end in the habitat, and stopped midway."""

from pathlib import Path
from typing import Any

import pytest
import structlog
from py_trees.common import Status

import regrasp
from regrasp.app.files.findings import Findings
from regrasp.app.run.compose import assemble, build_world
from regrasp.app.scenario.load import load_scenario

TREE = """
<root main_tree_to_execute="Mine">
  <BehaviorTree ID="Mine">
    <Sequence name="mine" memory="true">
      <MoveGripper name="open" gap="0.06"/>
      <MoveRail name="rail" position="1.5"/>
      <MoveToPose name="pose" x="-0.15" y="2.0" z="1.5" standoff="0.05"/>
      <MoveBy name="by" dx="0.03" dz="-0.05"/>
      <MoveJoints name="joints" q1="0.0" q2="-2.2" q3="2.3" q4="-1.67" q5="-1.5707963267948966" q6="0.0"/>
      <FailureIsSuccess name="on_nothing"><PressGripper name="press" force="20.0"/></FailureIsSuccess>
      <AnalyzeImage name="see" target="{target}" seconds="0.3"/>
    </Sequence>
  </BehaviorTree>
</root>
"""


def scenario(folder: Path, target: str, tree: str = TREE) -> Any:
    (folder / "mine.xml").write_text(tree.replace("{target}", target))
    path = folder / "mine.yaml"
    path.write_text(
        "description: Mine.\ncell: habitat\ntree: mine.xml\ngravity: zero\n"
        "expect: {outcome: failure, cause: target_not_seen}\n"
    )
    return load_scenario(str(path))


def test_a_tree_of_primitives_goes_through_them(tmp_path: Path) -> None:
    """All motions succeed; behind the closed door there is no part to see."""
    result = regrasp.run(scenario(tmp_path, "obj"), seed=2, out=tmp_path / "run")
    assert result.succeeded, [str(e) for e in result.expectations]
    assert result.cause is not None
    assert result.cause.node == "mine/see"


def test_a_leaf_tells_how_far_its_action_is_and_stops_the_arm_when_it_is_stopped(tmp_path: Path) -> None:
    mine = scenario(tmp_path, "obj")
    world = build_world(mine, 2)
    episode = assemble(mine, world, 2, structlog.get_logger())
    tree = episode.tree
    tree.setup(services=episode.services)
    told = []
    while world.now() < 1.2:
        tree.tick()
        told.append(next(node.feedback_message for node in tree.root.iterate() if node.name.endswith("rail")))
        world.advance(0.05)
    places = [float(text.split()[4]) for text in told if text.startswith("the rail is at")]
    assert len(places) > 5
    assert places == sorted(places, reverse=True)
    tree.root.stop(Status.INVALID)
    world.advance(0.6)
    stands = world.arms["arm"].reading().positions.copy()
    world.advance(0.5)
    assert world.arms["arm"].reading().positions == pytest.approx(stands, abs=1e-3)
    assert stands[0] > 1.51  # it was on its way
    world.close()


@pytest.mark.parametrize(
    ("target", "change", "told"),
    [
        ("door", ("", ""), "obj"),
        ("obj", ('position="1.5"', 'position="nan"'), "not finite"),
        ("obj", ("<MoveRail", "<FlyRail"), "unknown element 'FlyRail'"),
        ("obj", ('force="20.0"', 'force="-1"'), "above 0"),
        ("obj", ('gap="0.06"', 'gap="-0.01"'), "below 0"),
        ("obj", (' position="1.5"', ""), "position"),
    ],
)
def test_what_is_no_goal_is_a_line_before_anything_runs(
    target: str, change: tuple[str, str], told: str, tmp_path: Path
) -> None:
    with pytest.raises(Findings) as raised:
        scenario(tmp_path, target, TREE.replace(*change) if change[0] else TREE)
    assert any(told in str(item) and "mine.xml:" in str(item) for item in raised.value.items)


PARALLEL = """
<root main_tree_to_execute="Mine">
  <BehaviorTree ID="Mine"><Parallel name="both" policy="success_on_all">{leaves}</Parallel></BehaviorTree>
</root>
"""


@pytest.mark.parametrize(
    "leaves",
    [
        '<MoveRail name="first" position="1.0"/><MoveToPose name="second" x="-0.1" y="2.3" z="1.6"/>',
        '<AnalyzeImage name="first" target="obj"/><AnalyzeImage name="second" target="targ"/>',
        '<MoveToPose name="first" x="-0.1" y="2.3" z="1.6"/><ArmBack name="second" distance="0.05"/>',
    ],
)
def test_a_leaf_whose_goal_is_preempted_fails(tmp_path: Path, leaves: str) -> None:
    mine = scenario(tmp_path, "obj", PARALLEL.format(leaves=leaves))
    result = regrasp.run(mine, seed=2, out=tmp_path / "run")
    assert result.cause is not None
    assert (result.cause.code, result.cause.node) == ("preempted", "both/first")


GRIP = """
<MoveGripper name="fit" gap="0.05"/><RailToHandle name="rail" beside="-0.2"/>
<LookAtHandle name="look" standoff="0.20" seconds="1.0"/><ReachHandle name="reach" standoff="0.08"/>
<GripHandle name="grip"/>
"""
STOPPED = f"""
<root main_tree_to_execute="Mine">
  <BehaviorTree ID="Mine">
    <Fallback name="again" memory="true">
      <Sequence name="first" memory="true">
        {GRIP}<TimeLimit name="limit" seconds="3"><SlideDoor name="slide" opening="0.43"/></TimeLimit>
      </Sequence>
      <SlideDoor name="on" opening="0.43"/>
    </Fallback>
  </BehaviorTree>
</root>
"""


def test_a_slide_that_was_stopped_goes_on_up_to_the_door_s_end_stop(tmp_path: Path) -> None:
    result = regrasp.run(scenario(tmp_path, "obj", STOPPED), seed=2, out=tmp_path / "run")
    assert result.outcome == "success"
    assert result.measured["door_open"] == pytest.approx(0.43, abs=0.003)


def test_a_closed_jaw_is_not_brought_to_the_handle(tmp_path: Path) -> None:
    tree = STOPPED.replace('gap="0.05"', 'gap="0.0"')
    result = regrasp.run(scenario(tmp_path, "obj", tree), seed=2, out=tmp_path / "run")
    assert "the handle is 20.0 mm thick" in (tmp_path / "run" / "events.jsonl").read_text()
    assert result.outcome == "failure"
