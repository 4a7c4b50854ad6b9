"""What the check says that a tree cannot do is never seen in a run of it."""

from pathlib import Path

import py_trees
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from py_trees.common import Status
from py_trees.parsers.behaviour_tree_xml import parse_behaviour_tree_xml
from py_trees.ports import NoDataAvailable
from random_trees import KEYED, LEAVES, Dice, trees

from regrasp.behaviors.keys import MissingKeyError
from regrasp.trees import check_tree


def line_of(name: str) -> int:
    return int(name.rpartition(".n")[2].removeprefix("n"))


def seen(path: Path, seed: int) -> dict[str, set[int]]:
    """The lines whose node was ticked, whose Parallel succeeded, and whose reader found a value, in one random run."""
    py_trees.blackboard.Blackboard.clear()
    root = parse_behaviour_tree_xml(str(path), node_registry=dict(LEAVES))
    Dice.dice.seed(seed)
    Dice.ticked.clear()
    reached: set[int] = set()
    succeeded: set[int] = set()
    try:
        for _ in range(8):
            for node in root.tick():
                reached.add(line_of(node.name))
                if node.status is Status.SUCCESS:
                    succeeded.add(line_of(node.name))
            if root.status is not Status.RUNNING:
                break
    except (NoDataAvailable, MissingKeyError):
        pass
    return {"never reached": reached, "never succeed": succeeded, "before": {line_of(name) for name in Dice.ticked}}


WORDS = {
    "is never reached": "never reached",
    "can never succeed": "never succeed",
    "reads /": "before",
    "needs toy/": "before",
}


@settings(max_examples=30)
@given(text=trees() | trees(KEYED), seeds=st.lists(st.integers(0, 2**32), min_size=3, max_size=3))
def test_no_run_shows_what_a_finding_says_cannot_be(
    tmp_path_factory: pytest.TempPathFactory, text: str, seeds: list[int]
) -> None:
    path = tmp_path_factory.getbasetemp() / "random.xml"
    path.write_text(text)
    findings = check_tree(path, LEAVES)
    for seed in seeds:
        run = seen(path, seed)
        for line, sentence in findings:
            for words, what in WORDS.items():
                assert words not in sentence or line not in run[what], sentence


def check(tmp_path: Path, body: str, inner: str = "") -> list[str]:
    """The sentences about a main tree of this body."""
    path = tmp_path / "tree.xml"
    main = f'<BehaviorTree ID="Main">{body}</BehaviorTree>'
    path.write_text(f'<root main_tree_to_execute="Main">{main}{inner}</root>')
    return [sentence for _, sentence in check_tree(path, LEAVES)]


def sequence(*children: str, tag: str = "Sequence", memory: str = "true", name: str = "s") -> str:
    return f'<{tag} name="{name}" memory="{memory}">{"".join(children)}</{tag}>'


READ, WRITE, DICE = '<Read name="r" x="{a}"/>', '<Write name="w" x="{a}"/>', '<Dice name="d"/>'
TOO_EARLY = ["Read 'r': x={a} reads /a before anything can have written it; tick Write 'w' of line 1 before it"]


def wrapped(tag: str, child: str, attributes: str = "") -> str:
    return f'<{tag} name="t" {attributes}>{child}</{tag}>'


def parallel(policy: str, *children: str) -> str:
    return f'<Parallel name="p" policy="{policy}">{"".join(children)}</Parallel>'


RETRY = 'num_failures="3"'
EARLY = {
    "first in a sequence": sequence(READ, WRITE),
    "first at every tick": sequence(READ, WRITE, memory="false"),
    "a fallback's first": sequence(READ, WRITE, tag="Fallback"),
    "first in a parallel": parallel("success_on_all", READ, WRITE),
    "first of every try": wrapped("Retry", sequence(READ, WRITE), RETRY),
    "a writer that is skipped": sequence('<Yes name="y"/>', READ, WRITE),
    "a fallback whose writer comes only after it": sequence(sequence(READ, DICE, tag="Fallback", name="f"), WRITE),
}
IN_TIME = {
    "a writer before it": sequence(WRITE, READ),
    "a writer that may have failed": sequence(WRITE, READ, tag="Fallback"),
    "a writer in a branch": sequence(sequence(DICE, WRITE, tag="Fallback", name="f"), READ),
    "a parallel's first writes": parallel("success_on_all", WRITE, READ),
    "a parallel's second, while a guard holds the first": parallel("success_on_one", sequence(DICE, READ), WRITE),
    "a later try": wrapped("Retry", sequence(sequence(DICE, READ, name="s1"), WRITE, tag="Fallback"), RETRY),
    "a later round": wrapped(
        "Repeat", sequence(sequence(DICE, READ, name="s1"), WRITE, tag="Fallback"), 'num_success="2"'
    ),
    "a later tick": sequence(sequence(DICE, READ, name="s1"), wrapped("FailureIsRunning", WRITE), tag="Fallback"),
}


@pytest.mark.parametrize("body", EARLY.values(), ids=EARLY.keys())
def test_a_key_that_is_read_before_any_run_can_have_written_it_is_a_finding(tmp_path: Path, body: str) -> None:
    assert [s for s in check(tmp_path, body) if "Read" in s] == TOO_EARLY


PUT, TURN, NEED, BOTH = '<Put name="p"/>', '<Turn name="t"/>', '<Need name="n"/>', '<NeedBoth name="b"/>'
IN_TIME |= {
    "a key of two": sequence(PUT, TURN, BOTH),
    "a key that may be cleared": sequence(PUT, TURN, NEED),
    "a key in a later try": wrapped("Retry", sequence(sequence(DICE, NEED, name="s1"), PUT, tag="Fallback"), RETRY),
}


@pytest.mark.parametrize("body", IN_TIME.values(), ids=IN_TIME.keys())
def test_a_key_that_some_run_writes_first_is_none(tmp_path: Path, body: str) -> None:
    assert check(tmp_path, body) == []


BUSY, NO, YES = '<Busy name="b"/>', '<No name="n"/>', '<Yes name="y"/>'
NEVER = {
    "after a child that never succeeds": (
        sequence(NO, DICE),
        "Dice 'd' is never reached: No 'n' before it never",
    ),
    "after a child that never fails": (
        sequence(YES, DICE, tag="Fallback"),
        "Dice 'd' is never reached: Yes 'y'",
    ),
    "after a child that is always running": (sequence(BUSY, DICE, tag="Fallback"), "Dice 'd' is never reached"),
    "after an inverted one": (sequence(wrapped("Inverter", YES), DICE), "Dice 'd' is never reached: Inverter 't'"),
    "after a subtree": (
        sequence('<SubTree ID="In" name="in"/>', DICE),
        "Dice 'd' is never reached: SubTree 'in' before it never succeeds; move it before that, or remove it",
    ),
    "all of a parallel": (
        parallel("success_on_all", DICE, wrapped("SuccessIsRunning", YES)),
        "Parallel 'p' can never succeed with success_on_all: SuccessIsRunning 't' never does; write policy=",
    ),
    "a condition that never holds": (
        parallel("success_on_all", DICE, wrapped("Condition", YES, 'status="failure"')),
        "Parallel 'p' can never succeed with success_on_all: Condition 't' never does",
    ),
    "one of a parallel": (
        parallel("success_on_one", BUSY, NO),
        "Parallel 'p' can never succeed with success_on_one: none of its children ever does; give it one that does",
    ),
    "a parallel with a child that always fails": (
        parallel("success_on_one", DICE, wrapped("SuccessIsFailure", YES)),
        "Parallel 'p' can never succeed with success_on_one: SuccessIsFailure 't' always fails; take it out",
    ),
}


@pytest.mark.parametrize(("body", "sentence"), NEVER.values(), ids=NEVER.keys())
def test_what_no_run_can_reach_or_let_succeed_is_a_finding(tmp_path: Path, body: str, sentence: str) -> None:
    inner = f'<BehaviorTree ID="In">{NO}</BehaviorTree>' if "SubTree" in body else ""
    found = check(tmp_path, body, inner)
    assert len(found) == 1
    assert found[0].startswith(sentence)


def test_an_element_of_a_subtree_counts_as_reached_when_one_place_reaches_it(tmp_path: Path) -> None:
    inner = f'<BehaviorTree ID="In">{sequence(DICE, YES)}</BehaviorTree>'
    call = '<SubTree ID="In" name="{}"/>'
    assert check(tmp_path, sequence(call.format("a"), call.format("b")), inner) == []
    assert [s.partition(":")[0] for s in check(tmp_path, sequence(call.format("a"), NO, call.format("b")), inner)] == [
        "SubTree 'b' is never reached"
    ]
