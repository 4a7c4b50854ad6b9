from collections.abc import Iterator
from pathlib import Path

import py_trees
import pytest
from hypothesis import given
from hypothesis import strategies as st
from toy_leaves import GOOD, LEAVES

from trees import check_tree, load_tree


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
        "Sequence 'root' does not state memory; write memory=\"...\": true or false",
    ),
    "memory that py_trees reads as false": (
        'memory="true"',
        'memory="yes"',
        3,
        "memory='yes' is unknown; there are false, true",
    ),
    "unknown attribute of a control node": ('memory="true"', 'memory="true" memry="1"', 3, "did you mean memory?"),
    "unknown port": ("angle=", "angel=", 16, "unknown attribute of Look 'angel'; did you mean angle?"),
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
    "unknown leaf": ("<Go ", "<Goo ", 9, "unknown element 'Goo'; did you mean Go?"),
    "tag in the wrong case": ("<Go ", "<go ", 9, "unknown element 'go'; did you mean Go?"),
    "wall clock": ("Inverter", "Timeout", 15, "unknown element 'Timeout'"),
    "missing name": ('name="go" ', "", 9, "Go has the name ''; give it one of letters"),
    "dotted name": ('name="go"', 'name="go.on"', 9, "Go has the name 'go.on'"),
    "duplicate name": ('name="move"', 'name="watch"', 7, "the name 'watch' is taken by a sibling"),
    "unknown policy": (
        '"success_on_one"',
        '"success_on_any"',
        5,
        "'success_on_any' is unknown; did you mean success_on_one?",
    ),
    "policy that cannot be built": ("success_on_one", "success_on_selected", 5, "'success_on_selected' is unknown"),
    "missing subtree": ('ID="Search" name', 'ID="Serch" name', 4, "unknown subtree 'Serch'; did you mean Search?"),
    "unknown main tree": ('execute="Main"', 'execute="Man"', 1, "unknown main tree 'Man'; did you mean Main?"),
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
    "include": ("</root>", '<Include file="/etc/passwd"/></root>', 20, "Include is refused"),
    "not XML": ("</Inverter>", "", 17, "malformed XML: mismatched tag; close <Inverter> of line 15"),
    "entities": ("<root", '<!DOCTYPE root [<!ENTITY e SYSTEM "file:///etc/passwd">]>\n<root', 1, "document type"),
}


@pytest.mark.parametrize(("old", "new", "line", "message"), CASES.values(), ids=CASES.keys())
def test_each_fault_is_named_with_its_line(tmp_path: Path, old: str, new: str, line: int, message: str) -> None:
    assert old in GOOD
    findings = check(tmp_path, GOOD.replace(old, new) if old == "Inverter" else GOOD.replace(old, new, 1))
    assert any(at == line and message in text for at, text in findings), findings


def test_all_findings_come_at_once_in_line_order(tmp_path: Path) -> None:
    text = GOOD.replace('memory="true"', "").replace("<Go ", "<Goo ").replace('ticks="1"', 'ticks=""')
    assert [line for line, _ in check(tmp_path, text)] == [3, 9, 15]


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


WORDS = st.sampled_from(GOOD.replace('"', ' " ').replace("<", " < ").replace(">", " > ").split())


@given(at=st.integers(0, len(GOOD)), length=st.integers(0, 30), insert=st.lists(WORDS, max_size=3).map("".join))
def test_whatever_passes_the_check_loads(
    tmp_path_factory: pytest.TempPathFactory, at: int, length: int, insert: str
) -> None:
    path = tmp_path_factory.getbasetemp() / "mutant.xml"
    path.write_text(GOOD[:at] + insert + GOOD[at + length :])
    if not check_tree(path, LEAVES):
        load_tree(path, LEAVES)
        py_trees.blackboard.Blackboard.clear()
