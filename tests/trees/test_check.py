from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import py_trees
import pytest
import random_trees
from hypothesis import given, settings
from hypothesis import strategies as st
from py_trees.common import Status
from py_trees.ports import BehaviourWithPorts, NoDataAvailable, PortInformation
from toy_leaves import GOOD, LEAVES

from regrasp.behaviors.keys import MissingKeyError
from regrasp.trees import check_tree, load_tree


@pytest.fixture(autouse=True)
def _clear_blackboard() -> Iterator[None]:
    yield
    py_trees.blackboard.Blackboard.clear()


def check(tmp_path: Path, text: str) -> list[tuple[int, str]]:
    (tmp_path / "tree.xml").write_text(text)
    return check_tree(tmp_path / "tree.xml", LEAVES)


def test_a_good_tree_has_no_findings(tmp_path: Path) -> None:
    assert check(tmp_path, GOOD) == []


CASES = {
    "memory not stated": (
        'name="root" memory="true"',
        'name="root"',
        3,
        "Sequence 'root' does not state memory; write memory=\"...\" (true or false)",
    ),
    "memory that py_trees reads as false": (
        'memory="true"',
        'memory="yes"',
        3,
        "memory='yes' is unknown; there are false, true",
    ),
    "unknown attribute of a control node": ('memory="true"', 'memory="true" memry="1"', 3, "did you mean 'memory'?"),
    "unknown port": ("angle=", "angel=", 16, "unknown attribute of Look 'angel'; did you mean 'angle'?"),
    "missing port": ('ticks="99"', "", 6, "does not state ticks"),
    "port of another type": ('ticks="99"', 'ticks="9.5"', 6, "ticks='9.5' is no int"),
    "port not finite": ('angle="0.25"', 'angle="nan"', 16, "angle='nan' is not finite"),
    "malformed key": ('place="{place}"/>\n    </S', 'place="{place"/>\n    </S', 9, "neither a literal nor a {key}"),
    "output without key": ('camera="{camera}" place="{place}"', 'camera="{camera}" place="1.0"', 16, "is an output"),
    "key that nobody writes": ('name="go" place="{place}"', 'name="go" place="{plaice}"', 9, "which no port writes"),
    "key lost between trees": (' place="{place}" tries="2"', ' tries="2"', 9, "which no port writes"),
    "key that the subtree has not": (
        ' tries="2"',
        ' trise="2"',
        4,
        "unknown key of subtree Search 'trise'; did you mean",
    ),
    "subtree literal of another type": ('tries="2"', 'tries="two"', 13, "is 'two' here, which is no int"),
    "no tries": (
        'tries="2"',
        'tries="0"',
        13,
        "num_failures={tries} is '0' here, which is not above 0; write more than 0",
    ),
    "decorator argument not constant": ('num_failures="{tries}"', 'num_failures="{place}"', 13, "must be a constant"),
    "unknown leaf": ("<Go ", "<Goo ", 9, "unknown element 'Goo'; did you mean 'Go'?"),
    "tag in the wrong case": ("<Go ", "<go ", 9, "unknown element 'go'; did you mean 'Go'?"),
    "wall clock": ("Inverter", "Timeout", 15, "unknown element 'Timeout'"),
    "missing name": ('name="go" ', "", 9, "Go has no name; give it one of letters"),
    "dotted name": ('name="go"', 'name="go.on"', 9, "Go has the name 'go.on'"),
    "duplicate name": ('name="move"', 'name="watch"', 7, "the name 'watch' is taken by a sibling"),
    "unknown policy": (
        '"success_on_one"',
        '"success_on_any"',
        5,
        "'success_on_any' is unknown; did you mean 'success_on_one'?",
    ),
    "policy that cannot be built": ("success_on_one", "success_on_selected", 5, "'success_on_selected' is unknown"),
    "missing subtree": ('ID="Search" name', 'ID="Serch" name', 4, "unknown subtree 'Serch'; did you mean 'Search'?"),
    "unknown main tree": ('execute="Main"', 'execute="Man"', 1, "unknown main tree 'Man'; did you mean 'Main'?"),
    "no main tree": (' main_tree_to_execute="Main"', "", 1, "root does not state main_tree_to_execute; write"),
    "subtree that includes itself": (
        '<Look name="look"',
        '<SubTree ID="Search" name="me" place="{place}"/><Look name="look"',
        16,
        "subtree 'Search' includes itself here",
    ),
    "two subtrees with one namespace": (
        '<Go name="go" place="{place}"/>',
        '<Inverter name="x"><SubTree ID="Search" name="search" place="{place}"/></Inverter>',
        9,
        "they would share their keys",
    ),
    "leaf with a child": (
        'ticks="2"/>',
        'ticks="2"><Fail name="f"/></Wait>',
        7,
        "Wait 'move' takes no children and has 1; move them out of it",
    ),
    "decorator of two": (
        '<Wait name="blink"',
        '<Fail name="f"/><Wait name="blink"',
        15,
        "Inverter 'not_yet' takes one child and has 2; move them into a Sequence",
    ),
    "empty composite": (
        '<Go name="go" place="{place}"/>',
        '<Fallback name="e" memory="true"/>',
        9,
        "Fallback 'e' has no child; put one inside",
    ),
    "tree of two": (
        "    </Sequence>\n",
        '    </Sequence><Fail name="f"/>\n',
        2,
        "BehaviorTree has 2 children; give it one",
    ),
    "tree given twice": ('ID="Search" camera', 'ID="Main" camera', 2, "BehaviorTree ID 'Main' is given twice"),
    "tree without ID": ('ID="Search" camera', 'ID="" camera', 12, 'BehaviorTree has no ID; write ID="..."'),
    "subtree without ID": ('ID="Search" name', "name", 4, "SubTree 'search' has no ID; write ID=\"...\" of the Behav"),
    "empty main tree": ('execute="Main"', 'execute=""', 1, "does not state main_tree_to_execute"),
    "py_trees' own Timeout": (
        "<Go ",
        '<Timeout name="t" duration="1.0"><Fail name="f"/></Timeout><Go ',
        9,
        "unknown element 'Timeout'; write <TimeLimit seconds=",
    ),
    "reactive fallback of BehaviorTree.CPP": (
        "<Go ",
        '<ReactiveFallback name="r"><Fail name="f"/></ReactiveFallback><Go ',
        9,
        "unknown element 'ReactiveFallback'; write <Fallback memory=\"false\">",
    ),
    "include": ("</root>", '<Include file="/etc/passwd"/></root>', 20, "Include is refused"),
    "import": ("</root>", '<Import src="other.xml"/></root>', 20, "Import is refused, a tree is one file; copy the"),
    "tree that nothing includes": (
        "</root>",
        '<BehaviorTree ID="Left"><Fail name="f"/></BehaviorTree></root>',
        20,
        "BehaviorTree 'Left' is never run; include it with a SubTree, or remove it",
    ),
    "key written as two types": (
        "<Go ",
        '<Say name="say" word="{place}"/><Go ',
        9,
        "Say 'say': word={place} writes str, but line 16 writes float to it; write one type, or use two keys",
    ),
    "key read as another type": (
        "<Go ",
        '<Hear name="hear" word="{place}"/><Go ',
        9,
        "Hear 'hear': word={place} reads str, but line 16 writes float to it; wire ports of one type",
    ),
    "key that is read too early": (
        '<SubTree ID="Search"',
        '<Go name="early" place="{place}"/><SubTree ID="Search"',
        4,
        "Go 'early': place={place} reads /place before anything can have written it; tick Look 'look' of line 16",
    ),
    "child that is never reached": (
        "<Go ",
        '<SuccessIsRunning name="r"><Wait name="w" ticks="1"/></SuccessIsRunning><Go ',
        9,
        "Go 'go' is never reached: SuccessIsRunning 'r' before it never succeeds; move it before that, or remove it",
    ),
    "parallel that never succeeds": (
        'policy="success_on_one">',
        'policy="success_on_all"><FailureIsRunning name="r"><Inverter name="i"><Inverter name="j">'
        '<SuccessIsFailure name="k"><Wait name="w" ticks="1"/></SuccessIsFailure>'
        "</Inverter></Inverter></FailureIsRunning>",
        5,
        "Parallel 'carry' can never succeed with success_on_all: FailureIsRunning 'r' never does; write policy",
    ),
    "attribute given twice": ('ticks="99"', 'ticks="99" ticks="9"', 6, "duplicate attribute; give each attribute once"),
    "bare ampersand": (
        'ticks="99"',
        'ticks="9&9"',
        6,
        "not well-formed (invalid token); write & as &amp;",
    ),
    "not XML": ("</Inverter>", "", 17, "malformed XML: mismatched tag; close <Inverter> of line 15"),
    "entities": ("<root", '<!DOCTYPE root [<!ENTITY e SYSTEM "file:///etc/passwd">]>\n<root', 1, "document type"),
    "stray text": ("</Inverter>", "stray</Inverter>", 15, "stray text 'stray'; put it in a <!-- comment -->"),
}


@pytest.mark.parametrize(("old", "new", "line", "message"), CASES.values(), ids=CASES.keys())
def test_each_fault_is_named_with_its_line(tmp_path: Path, old: str, new: str, line: int, message: str) -> None:
    assert old in GOOD
    findings = check(tmp_path, GOOD.replace(old, new) if old == "Inverter" else GOOD.replace(old, new, 1))
    assert any(at == line and message in text for at, text in findings), findings
    assert all("; " in text for _, text in findings), "what is wrong; what would be right"


def test_all_findings_come_at_once_in_line_order(tmp_path: Path) -> None:
    text = GOOD.replace('memory="true"', "").replace("<Go ", "<Goo ").replace('ticks="1"', 'ticks=""')
    assert [line for line, _ in check(tmp_path, text)] == [3, 9, 15]


def test_a_loop_elsewhere_hides_no_finding_of_the_tree_that_runs(tmp_path: Path) -> None:
    loop = '<BehaviorTree ID="Old"><SubTree ID="Old" name="again"/></BehaviorTree></root>'
    text = GOOD.replace('tries="2"', 'tries="0"').replace("</root>", loop)
    assert [line for line, _ in check(tmp_path, text)] == [13, 20, 20]


def test_one_misspelt_writer_is_one_finding(tmp_path: Path) -> None:
    for old, new in (("<Look ", "<Lok "), (' place="{place}"/>\n      </F', ' plac="{place}"/>\n      </F')):
        assert [line for line, _ in check(tmp_path, GOOD.replace(old, new))] == [16]


def test_an_output_with_a_default_is_there_from_the_start(tmp_path: Path) -> None:
    leaves = '<Hear name="hear" word="{w}"/><Say name="say" word="{w}"/>'
    assert check(tmp_path, GOOD.replace("<Go ", leaves + "<Go ")) == []
    tree = py_trees.trees.BehaviourTree(load_tree(tmp_path / "tree.xml", LEAVES))
    tree.setup()
    tree.tick()
    tree.tick()
    assert tree.root.status is Status.SUCCESS


def test_a_missing_file_a_folder_and_an_odd_encoding_are_findings(tmp_path: Path) -> None:
    (tmp_path / "odd.xml").write_bytes(b"<?xml version='1.0' encoding='nonsense'?><root/>")
    (tmp_path / "binary.xml").write_bytes(bytes(range(256)))
    for name in ("none.xml", ".", "odd.xml", "binary.xml"):
        assert len(check_tree(tmp_path / name, LEAVES)) == 1


def test_trees_that_would_grow_without_bound_are_refused(tmp_path: Path) -> None:
    def layer(i: int, inner: str) -> str:
        return f'<BehaviorTree ID="T{i}"><Sequence name="s" memory="true">{inner}</Sequence></BehaviorTree>'

    def tree(width: int, layers: int) -> str:
        body = "".join(
            layer(i, "".join(f'<SubTree ID="T{i + 1}" name="t{j}"/>' for j in range(width))) for i in range(layers)
        )
        end = layer(layers, '<Fail name="f"/>')
        return f'<root main_tree_to_execute="T0">{body}{end}</root>'

    assert "nodes once" in check(tmp_path, tree(10, 30))[0][1]
    assert "deeper than" in check(tmp_path, tree(1, 300))[0][1]
    assert "nested deeper" in check(tmp_path, "<a>" * 100 + "</a>" * 100)[0][1]
    deepest = tree(1, 70)
    assert check(tmp_path, deepest) == []
    load_tree(tmp_path / "tree.xml", LEAVES)


def test_a_file_that_no_hand_wrote_is_told_in_few_words(tmp_path: Path) -> None:
    trees = "".join(f'<BehaviorTree ID="T{i}"><SubTree ID="x{i}" name="s"/></BehaviorTree>' for i in range(3000))
    findings = check(tmp_path, f'<root main_tree_to_execute="T0">{trees}</root>')
    assert len(findings) == 500
    [(_, sentence)] = check(tmp_path, GOOD.replace("Go name", "Go" * 50_000 + " name"))
    assert len(sentence) < 500


@dataclass(frozen=True)
class Limited(PortInformation):  # type: ignore[misc]
    above: float | None = None
    names: str | None = None


class Plug(BehaviourWithPorts):  # type: ignore[misc]
    INPUT_PORTS: ClassVar[dict[str, PortInformation]] = {
        "seconds": Limited(data_type=float, above=0.0),
        "socket": Limited(data_type=str, names="socket"),
    }
    OUTPUT_PORTS: ClassVar[dict[str, PortInformation]] = {}


@pytest.mark.parametrize("through_a_subtree", [False, True])
def test_a_leaf_states_what_its_ports_hold(tmp_path: Path, through_a_subtree: bool) -> None:
    path, names = tmp_path / "tree.xml", {"socket": ["back_1", "back_2"]}

    def findings(seconds: str, socket: str, names: dict[str, list[str]] | None) -> str:
        ports = 'seconds="{s}" socket="{t}"' if through_a_subtree else f'seconds="{seconds}" socket="{socket}"'
        keys = f's="{seconds}" t="{socket}"' if through_a_subtree else ""
        tree = f'<BehaviorTree ID="Main" {keys}><Plug name="plug" {ports}/></BehaviorTree>'
        path.write_text(f'<root main_tree_to_execute="Main">{tree}</root>')
        return "\n".join(sentence for _, sentence in check_tree(path, {"Plug": Plug}, names))

    assert findings("0.1", "back_2", names) == ""
    assert findings("0.1", "back_3", None) == ""
    assert "is unknown; did you mean 'back_" in findings("0.1", "back_3", names)
    assert "is not above 0; write more than 0" in findings("0", "back_1", names)
    assert "is not above 0; write more than 0" in findings("-1e300", "back_1", names)
    assert "is not finite; write a number such as 0.5" in findings("inf", "back_1", names)


WORDS = st.sampled_from(GOOD.replace('"', ' " ').replace("<", " < ").replace(">", " > ").split())
TEXTS = st.tuples(st.just(GOOD), st.just(LEAVES)) | st.tuples(random_trees.trees(), st.just(random_trees.LEAVES))


@settings(max_examples=50)
@given(tree=TEXTS, at=st.floats(0, 1), length=st.sampled_from([0, 0, 1, 5, 30]), insert=st.lists(WORDS, max_size=3))
def test_whatever_passes_the_check_loads_and_ticks(
    tmp_path_factory: pytest.TempPathFactory,
    tree: tuple[str, dict[str, type[py_trees.behaviour.Behaviour]]],
    at: float,
    length: int,
    insert: list[str],
) -> None:
    text, leaves = tree
    cut = int(at * len(text))
    path = tmp_path_factory.getbasetemp() / "mutant.xml"
    path.write_text(text[:cut] + "".join(insert) + text[cut + length :])
    if check_tree(path, leaves):
        return
    py_trees.blackboard.Blackboard.clear()
    root = load_tree(path, leaves)
    with suppress(NoDataAvailable, MissingKeyError):  # a writer may have failed, or not been ticked, in this run
        for _ in range(4):
            root.tick_once()
