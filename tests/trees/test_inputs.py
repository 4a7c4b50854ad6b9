from pathlib import Path

import pytest
from toy_leaves import LEAVES

from app.resources import shipped
from trees import check_inputs

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
        ({"tims": "5"}, ["tims: unknown input 'tims'; did you mean times?"]),
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
