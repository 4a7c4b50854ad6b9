from pathlib import Path

import pytest
from toy_leaves import LEAVES

from regrasp.app.files.resources import shipped
from regrasp.trees import check_inputs

TREE = """\
<root main_tree_to_execute="Main">
  <BehaviorTree ID="Main" times="3">
    <Retry name="again" num_failures="{times}"><SubTree ID="Below" name="below" times="{times}"/></Retry>
  </BehaviorTree>
  <BehaviorTree ID="Below" times="1" deep="2">
    <Repeat name="twice" num_success="{times}">
      <Repeat name="deep" num_success="{deep}"><Condition name="yes" status="success"/></Repeat>
    </Repeat>
  </BehaviorTree>
</root>
"""


@pytest.mark.parametrize(
    ("inputs", "expected"),
    [
        ({}, []),
        ({"times": "5"}, []),
        ({"tims": "5"}, ["tims: unknown input 'tims'; did you mean 'times'?"]),
        ({"deep": "5"}, ["deep: unknown input 'deep'; there are times"]),
        ({"ID": "Below"}, ["ID: unknown input 'ID'; there are times"]),
        (
            {"times": "0"},
            [
                "times: Retry 'again': num_failures={times} is '0' here, which is not above 0; write more than 0",
                "times: Repeat 'twice': num_success={times} is '0' here, which is not above 0; write more than 0",
            ],
        ),
    ],
)
def test_inputs_are_the_main_tree_s_defaults_and_suit_where_they_go(
    tmp_path: Path, inputs: dict[str, str], expected: list[str]
) -> None:
    path = tmp_path / "tree.xml"
    path.write_text(TREE)
    assert [f"{key}: {message}" for key, message in check_inputs(path, inputs, LEAVES)] == expected


def test_the_shipped_tree_takes_the_number_of_tries() -> None:
    path = shipped("tree")["recovery"]
    assert list(check_inputs(path, {"tries": "2"})) == []
    [(key, message)] = check_inputs(path, {"tries": "many"})
    assert (key, "is 'many' here, which is no int; " in message) == ("tries", True)


FLOW = """\
<root main_tree_to_execute="Main">
  <BehaviorTree ID="Main" status="success" ticks="3" first="success">
    <Sequence name="all" memory="true">
      <Condition name="once" status="{first}"><Seen name="seen"/></Condition>
      <Condition name="asked" status="{status}"><Seen name="seen"/></Condition>
      <Wait name="after" ticks="{ticks}"/>
    </Sequence>
  </BehaviorTree>
</root>
"""
NEVER = "Wait 'after' is never reached: Condition 'asked' before it never succeeds; move it before that, or remove it"


@pytest.mark.parametrize(
    ("inputs", "expected"),
    [
        ({"status": "failure", "ticks": "1"}, []),
        ({"status": "running"}, [f"status: {NEVER}"]),
        ({"ticks": "three"}, ["ticks: Wait 'after': ticks={ticks} is 'three' here, which is no int; write a whole"]),
        ({"ticks": "2.5", "status": "running"}, ["ticks: Wait 'after'", f"status: {NEVER}"]),
        ({"status": "perhaps"}, ["status: Condition 'asked': status={status} is 'perhaps' here, which is unknown"]),
    ],
)
def test_what_no_run_can_do_with_an_input_s_value_is_told_of_the_input(
    tmp_path: Path, inputs: dict[str, str], expected: list[str]
) -> None:
    path = tmp_path / "tree.xml"
    path.write_text(FLOW)
    found = [f"{key}: {message}" for key, message in check_inputs(path, inputs, LEAVES)]
    assert len(found) == len(expected)
    assert all(line.startswith(start) for line, start in zip(found, expected, strict=True))


def test_a_tree_with_findings_of_its_own_is_looked_at_too(tmp_path: Path) -> None:
    path = tmp_path / "tree.xml"
    path.write_text(FLOW.replace('name="all" memory="true"', 'name="all"').replace("<Wait", "<Wiat", 1))
    assert [key for key, _ in check_inputs(path, {"stats": "success", "first": "perhaps"}, LEAVES)] == [
        "stats",
        "first",
    ]
    path.write_text("<root")
    assert list(check_inputs(path, {"stats": "success"}, LEAVES)) == []
