from collections.abc import Callable
from pathlib import Path
from textwrap import dedent

import pytest
from hypothesis import given
from hypothesis import strategies as st
from py_trees.common import Status
from toy_leaves import GOOD, LEAVES

from regrasp.trees import TreeError
from regrasp.trees.scripted import Act, ScriptedTree, leaves_named_in, parse_script

Make = Callable[..., ScriptedTree]


@pytest.fixture
def good(tmp_path: Path) -> Path:
    (tmp_path / "good.xml").write_text(GOOD)
    return tmp_path / "good.xml"


def table(text: str) -> str:
    return dedent(text).strip("\n")


def test_a_script_says_for_each_entry_when_and_how_it_ends() -> None:
    assert parse_script("3 failure,2 success, running") == (
        Act(3, Status.FAILURE),
        Act(2, Status.SUCCESS),
        Act(1, Status.RUNNING),
    )


@pytest.mark.parametrize(
    "text", ["", "fail", "0 success", "-1 success", "1.5 success", "success,", "3success", "٣ success"]
)
def test_what_is_no_script_is_refused_with_an_example(text: str) -> None:
    with pytest.raises(ValueError, match="write such as '3 failure'"):
        parse_script(text)


def test_leaves_do_as_scripted_and_the_last_act_repeats(scripted_tree: Make, good: Path) -> None:
    script = {"Look": "2 failure, success", "watch": "running", "Wait": "3 success", "blink": "success"}
    tree = scripted_tree(good, script, leaves=LEAVES)
    assert tree.run() is Status.SUCCESS
    assert tree.table() == table("""
        tick   1   5
        root   RRRRS
        blink  SSS..
        look   RFS..
        watch  ..RRX
        move   ..RRS
        go     ....S
    """)
    assert (tree.entered("blink"), tree.entered("look"), tree.entered("carry/move")) == (3, 2, 1)
    assert tree.now() == pytest.approx(0.20)


def test_a_table_shows_any_node_at_every_tick_ten_to_a_ruler(scripted_tree: Make, good: Path) -> None:
    tree = scripted_tree(good, {"Look": "2 failure", "move": "9 success", "watch": "running"}, leaves=LEAVES)
    assert tree.run() is Status.FAILURE
    assert tree.table("again", "either", "root/go") == table("""
        tick    1
        again   RRRF
        either  RFRF
        go      ....
    """)
    tree = scripted_tree(good, {"move": "9 success", "watch": "running"}, leaves=LEAVES)
    tree.run()
    assert tree.table("move").splitlines()[0] == "tick  1   5"
    tree.run(until=10)
    assert tree.table("move").splitlines() == ["tick  1   5    10", "move  RRRRRRRRSR"]


def test_a_cancelled_tree_shows_what_it_stopped(scripted_tree: Make, good: Path) -> None:
    tree = scripted_tree(good, {"Wait": "9 success", "blink": "success"}, leaves=LEAVES)
    tree.run(until=2)
    assert (tree.status, tree.running) == (Status.RUNNING, ["root/carry/watch", "root/carry/move"])
    tree.cancel_at(4)
    assert (tree.status, tree.running) == (Status.INVALID, [])
    assert tree.table() == table("""
        tick   1
        root   RRRX
        blink  S...
        look   S...
        watch  RRRX
        move   RRRX
    """)
    assert [leaf.stopped for leaf in tree.leaves.values()] == [0, 0, 1, 1, 0]


def test_a_path_goes_before_a_tag_and_the_rest_do_the_default(scripted_tree: Make, good: Path) -> None:
    script = {"Wait": "failure", "root/carry/watch": "running", "move": "4 success"}
    tree = scripted_tree(good, script, default="2 success", leaves=LEAVES)
    assert tree.run() is Status.SUCCESS
    assert tree.table("blink", "look", "watch", "move", "go").splitlines()[1:] == [
        "blink  F....",
        "look   .....",
        "watch  RRRX.",
        "move   RRRS.",
        "go     ...RS",
    ]


@pytest.mark.parametrize(
    ("script", "message"),
    [
        ({"mvoe": "success"}, "no node 'mvoe'; there is move"),
        ({"carry": "success"}, "no node 'carry'; there is"),
        ({"move": "sucess"}, "'sucess' is no act"),
    ],
)
def test_a_script_that_does_not_suit_the_tree_is_refused(
    scripted_tree: Make, good: Path, script: dict[str, str], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        scripted_tree(good, script, leaves=LEAVES)


def test_leaves_do_only_what_the_real_ones_can(scripted_tree: Make) -> None:
    for leaf, text in {"DetectSlip": "success", "Monitor": "2 success", "Holding": "success, running"}.items():
        with pytest.raises(ValueError, match=r"never is \w+; it is"):
            scripted_tree("recovery", {leaf: text})
    tree = scripted_tree("recovery", {"Carry": "3 success"}, default="2 success")
    tree.run()
    assert tree.table("holding", "monitor", "detect_slip", "carry", "insert").splitlines()[1:] == [
        "holding      ..S.....",
        "monitor      ..SSSS..",
        "detect_slip  ..RRRX..",
        "carry        ..RRS...",
        "insert       ....RS..",
    ]


def test_stand_ins_have_the_ports_of_the_real_leaves(scripted_tree: Make, good: Path) -> None:
    good.write_text(GOOD.replace("angle=", "angel="))
    with pytest.raises(TreeError, match="did you mean 'angle'"):
        scripted_tree(good, leaves=LEAVES)


def test_a_foreign_tree_runs_on_the_names_that_it_gives(scripted_tree: Make, tmp_path: Path) -> None:
    (tmp_path / "foreign.xml").write_text("""\
<root main_tree_to_execute="Main">
  <BehaviorTree ID="Main">
    <Sequence name="root" memory="true">
      <OpenDoor name="open" handle="left" angle="{angle}"/>
      <SubTree ID="Pass" name="pass" angle="{angle}" speed="0.5"/>
    </Sequence>
  </BehaviorTree>
  <BehaviorTree ID="Pass"><Drive name="drive" angle="{angle}" speed="{speed}"/></BehaviorTree>
</root>""")
    leaves = leaves_named_in(tmp_path / "foreign.xml")
    assert sorted(leaves) == ["Drive", "OpenDoor"]
    tree = scripted_tree(tmp_path / "foreign.xml", {"OpenDoor": "2 success", "Drive": "failure"}, leaves=leaves)
    assert tree.run() is Status.FAILURE
    assert tree.table() == table("""
        tick   1
        root   RF
        open   RS
        drive  .F
    """)


def test_a_run_that_does_not_end_names_what_still_runs(scripted_tree: Make) -> None:
    tree = scripted_tree("recovery", {"StartUp": "failure"})  # the safe stop never succeeds, as by default it should
    with pytest.raises(
        RuntimeError, match="still runs after 10000 ticks, in SafeStop recovery/safe_stop; script how that ends"
    ):
        tree.run()


def test_inputs_take_the_place_of_the_trees_defaults(scripted_tree: Make) -> None:
    script = {"MakeRoom": "failure", "Holding": "failure", "SafeStop": "failure"}
    tree = scripted_tree("recovery", script, inputs={"tries": "2"})
    assert tree.run() is Status.FAILURE
    assert tree.entered("make_room") == 2


ACTS = st.builds(Act, st.integers(1, 9), st.sampled_from([Status.SUCCESS, Status.FAILURE]))


@given(acts=st.lists(ACTS, min_size=1, max_size=4))
def test_any_script_is_carried_out_to_the_letter(tmp_path_factory: pytest.TempPathFactory, acts: list[Act]) -> None:
    path = tmp_path_factory.getbasetemp() / "one.xml"
    path.write_text('<root main_tree_to_execute="M"><BehaviorTree ID="M"><Fail name="one"/></BehaviorTree></root>')
    text = ", ".join(f"{act.ticks} {act.status.value.lower()}" for act in acts)
    tree = ScriptedTree(path, {"one": text}, leaves=LEAVES)
    for act in acts:
        tree.run()
        assert tree.status is act.status
    expected = "".join("R" * (act.ticks - 1) + act.status.value[0] for act in acts)
    assert tree.table().splitlines()[1] == f"one   {expected}"


def test_a_loop_over_leaves_that_end_is_named_itself(tmp_path: Path) -> None:
    (tmp_path / "tree.xml").write_text(
        '<root main_tree_to_execute="M"><BehaviorTree ID="M">'
        '<Repeat name="loop" num_success="1000000"><StartUp name="start"/></Repeat></BehaviorTree></root>'
    )
    with pytest.raises(RuntimeError, match="still runs after 10000 ticks, in Repeat loop; script how"):
        ScriptedTree(tmp_path / "tree.xml").run()
