import math
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from regrasp.app.files.findings import Findings
from regrasp.app.files.yaml_lines import MAX_NESTING, parse


def findings(text: str) -> str:
    """All that is found, whether the rest of the document can be read or not."""
    try:
        return str(Findings(parse(text, "f.yaml").findings))
    except Findings as error:
        return str(error)


def read(text: str) -> str | tuple[Any, Any, int]:
    """What the document holds, and how many findings it has, or why it is refused."""
    try:
        document = parse(text, "f.yaml")
    except Findings as error:
        return str(error)
    return document.value, document.places, len(document.findings)


def test_every_value_knows_the_line_of_its_key() -> None:
    document = parse("a: 1\nb:\n  c: [x,\n    2.5]\n", "f.yaml")
    assert document.value == {"a": 1, "b": {"c": ["x", 2.5]}}
    lines = {path: line for path, (_, line) in document.places.items()}
    assert lines == {(): 1, ("a",): 1, ("b",): 2, ("b", "c"): 3, ("b", "c", 0): 3, ("b", "c", 1): 4}
    assert document.place(("b", "missing", 0)) == ("f.yaml", 2)


def test_a_merge_key_yields_to_own_keys_and_to_earlier_mappings() -> None:
    text = "a: &a {x: 1, y: 1}\nb: &b {y: 2, z: 2}\nc: {<<: [*a, *b], x: 3}\n"
    assert parse(text, "f.yaml").value == yaml.safe_load(text)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a: 1\na: 2", "f.yaml:2: key 'a' stands twice; keep one"),
        ("a: 1e3", "f.yaml:1: '1e3' is text to YAML, not a number; write 1.0e+3"),
        ("a: -2.5E9", "f.yaml:1: '-2.5E9' is text to YAML, not a number; write -2.5e+9"),
        ("a: .nan", "f.yaml:1: '.nan' is no plain finite number; write it such as 1000, 0.3 or 1.0e+3"),
        ("a: -.inf", "f.yaml:1: '-.inf' is no plain finite number"),
        ("a: 1.0e+999", "f.yaml:1: '1.0e+999' is no plain finite number"),
        ("a: 010", "f.yaml:1: '010' is 8 to some readers of YAML and not to others; write 8, or quotes around text"),
        ("a: 1:30", "f.yaml:1: '1:30' is 90 to some readers of YAML and not to others; write 90, or quotes"),
        ("a: 1_000", "f.yaml:1: '1_000' is 1000 to some readers of YAML and not to others; write 1000, or quotes"),
        ("a: " + "9" * 5000, "is no plain finite number"),
        ("\na: !!python/name:os.system", "f.yaml:2: tag 'tag:yaml.org,2002:python/name:os.system' is not allowed"),
        ("a: !!set {x}", "f.yaml:1: tag 'tag:yaml.org,2002:set' is not allowed"),
        ("[1]: 2", "f.yaml:1: a key must be a name; write text before the colon"),
        ("a: [1,\nb: 2", "f.yaml:2: not YAML: expected ',' or ']', but got '<stream end>'; close the bracket"),
        ("a: 1\n---\nb: 2", "f.yaml:2: not YAML: but found another document; keep one"),
        ("a: *nowhere", "f.yaml:1: not YAML: found undefined alias 'nowhere'; define it before"),
        ('a: "\\U99999999"', "f.yaml:1: not YAML:"),
        ("a: 1\nb: \x00", "f.yaml:2: not YAML: '\\x00' is not text; remove it"),
        ("a:\n\tb: 1", "f.yaml:2: not YAML: found character '\\t' that cannot start any token; indent with spaces"),
        ("a: b: c", "f.yaml:1: not YAML: mapping values are not allowed here; put text that holds a colon and a blank"),
        ("a: 'b", "f.yaml:1: not YAML: found unexpected end of stream; close the quotes"),
        ("a: 1\n  b: 2", "f.yaml:2: not YAML: mapping values are not allowed here; "),
        ("a:\n- 1\nb", "not YAML: could not find expected ':'; write key: value"),
        ("a: &a [*a]", "f.yaml:1: aliases expand to more than"),
        ("a: &a {<<: *a}", "f.yaml:1: aliases expand to more than"),
        ("a: {<<: 3}", "f.yaml:1: '<<' takes a mapping"),
        ("[" * 1000, f"nests deeper than {MAX_NESTING} levels"),
    ],
)
def test_what_yaml_lets_pass_is_a_finding(text: str, expected: str) -> None:
    assert expected in findings(text)


@pytest.mark.parametrize(("open_", "close"), [("[", "]"), ("{<<: [", "]}")])
def test_aliases_of_aliases_do_not_blow_up(open_: str, close: str) -> None:
    rows = ["a0: &a0 {x: 1}"] + [f"a{i}: &a{i} {open_}" + f"*a{i - 1}, " * 9 + close for i in range(1, 10)]
    assert "aliases expand to more than" in findings("\n".join(rows))


def test_all_findings_come_at_once() -> None:
    assert findings("a: 1e3\nb: .inf\nb: 010\n").count("\n") == 2


@given(st.text(max_size=12))
def test_every_finding_says_what_would_be_right(text: str) -> None:
    for line in findings(f"a: {text}").splitlines():
        assert "; " in line, line


def test_a_number_that_cannot_be_read_leaves_the_rest() -> None:
    document = parse("a: [1, .nan, 3]\nb: 2\n", "f.yaml")
    assert document.value == {"a": [1, None, 3], "b": 2}
    assert document.unread == {("a", 1)}


def test_an_overridden_line_holds_for_all_values() -> None:
    assert set(parse("[1, {a: 2}]", "--set", 4).places.values()) == {("--set", 4)}


@given(st.floats(allow_nan=False, allow_infinity=False, width=32))
def test_dumped_numbers_are_read_back(number: float) -> None:
    read = parse(yaml.safe_dump({"a": number}), "f.yaml").value
    assert isinstance(read, dict)
    assert isinstance(read["a"], float)
    assert math.isclose(read["a"], number)


_plain = st.recursive(
    st.none() | st.booleans() | st.integers(-(10**9), 10**9) | st.text(st.characters(codec="ascii")),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text("abcxyz", min_size=2), inner, max_size=3),
    max_leaves=10,
)


@given(_plain)
def test_values_without_a_pitfall_read_as_yaml_reads_them(value: object) -> None:
    text = yaml.safe_dump(value)
    if "e" not in text.replace("false", "").replace("true", ""):  # a bare 1e3 is refused
        assert parse(text, "f.yaml").value == yaml.safe_load(text)


def test_many_values_without_an_alias_are_not_blamed_on_one() -> None:
    told = findings("a:\n" + "".join("  - [1, 2, 3, 4, 5, 6, 7, 8, 9]\n" for _ in range(2500)))
    assert "more than 20000 values; shorten the file, or split it" in told


@given(
    st.lists(
        st.tuples(st.floats(0, 1), st.integers(0, 3), st.sampled_from(list(":-[]{},'\"#|>&*!%? \n\t1e.~"))), max_size=3
    )
)
def test_what_is_right_reads_the_same_with_and_without_libyaml(edits: list[tuple[float, int, str]]) -> None:
    text = "a: 1\nb: [x, 2.5, '3']\nc:\n- {d: 1e3, e: ~}\n- |\n  text\n# end\n"
    for share, cut, token in edits:
        at = int(share * len(text))
        text = text[:at] + token + text[at + cut :]
    with pytest.MonkeyPatch.context() as patch:
        with_it = read(text)
        patch.setattr(yaml, "CSafeLoader", yaml.SafeLoader)
        without = read(text)
    if not isinstance(without, str) and without[2] == 0:
        assert with_it == without
