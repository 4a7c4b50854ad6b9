"""Each mistake in a URDF is one line that names the joint or link and the attribute."""

import re
from pathlib import Path

import pytest
from toy_robot import URDF, write_robot

from regrasp.app.files.findings import Findings
from regrasp.app.robots.robot_file import load_robot

UP = '<axis xyz="0 0 1"/>'
TURN = '<joint name="turn" type="revolute"><parent link="base"/><child link="upper"/>'
WRONG = {
    "lower that is a word": ('lower="-3"', 'lower="abc"', "joint 'turn': limit lower is 'abc'; write a finite number"),
    "lower that is no number": ('lower="-3"', 'lower="nan"', "joint 'turn': limit lower is 'nan'"),
    "an axis of two numbers": (UP, '<axis xyz="0 0"/>', "joint 'turn': axis xyz is '0 0'; write 3 finite numbers"),
    "an axis with a nan": (UP, '<axis xyz="0 0 nan"/>', "joint 'turn': axis xyz is '0 0 nan'"),
    "an axis of zeros": (UP, '<axis xyz="0 0 0"/>', "joint 'turn': axis xyz is zero; write the direction"),
    "an origin of four": ('xyz="0 0 0.06"', 'xyz="0 0 0.06 1"', "joint 'turn': origin xyz is '0 0 0.06 1'"),
    "an origin that is too large": ('xyz="0 0 0.15"', 'xyz="0 0 1e999"', "link 'upper': origin xyz is '0 0 1e999'"),
    "a box of two lengths": ('size="0.2 0.2 0.1"', 'size="0.2 0.2"', "link 'base': box size is '0.2 0.2'"),
    "two joints of a name": ('name="bend"', 'name="turn"', "2 joints are named 'turn'; give each a name of its own"),
    "two links of a name": ('<link name="left">', '<link name="right">', "2 links are named 'right'"),
    "a joint without a name": ('name="bend" ', "", "a joint has no name"),
    "an unknown type": (TURN, TURN.replace("revolute", "revolt"), "no type 'revolt'; did you mean 'revolute'?"),
    "a parent that is not there": (TURN, TURN.replace("base", "bass"), "joint 'turn': its parent is 'bass', and"),
    "no child": (TURN, TURN.replace('<child link="upper"/>', ""), "joint 'turn': its child is missing; write <child"),
    "a child of two": (
        TURN,
        '<joint name="two" type="fixed"><parent link="base"/><child link="upper"/></joint>' + TURN,
        "link 'upper' is the child of two joints, 'two' and 'turn'",
    ),
    "a link that hangs on nothing": (
        "</robot>",
        '<link name="tip"/></robot>',
        "no joint carries the links",
    ),
    "a mimic of nothing": (UP, UP + '<mimic joint="bond"/>', "joint 'turn': it mimics 'bond'; did you mean 'bend'?"),
    "a negative mass": (
        '<link name="base">',
        '<link name="base"><inertial><mass value="-2"/></inertial>',
        "link 'base': mass value is -2",
    ),
    "a driven joint that floats": (TURN, TURN.replace("revolute", "floating"), "joint 'turn' is floating; driven ones"),
    "no speed": ('upper="3" velocity="2"', 'upper="3" velocity="0"', "velocity of turn is 0 in the URDF; write speed:"),
    "a web page": (URDF, "<html><body/></html>", "its root element is <html>, not <robot>"),
    "an empty file": (URDF, "", "toy.urdf:1: no XML: no element found"),
    "no links": (URDF, "<robot/>", "it has no <link>"),
}


def finding(folder: Path, urdf: str | bytes) -> str:
    path = write_robot(folder)
    (folder / "toy.urdf").write_bytes(urdf if isinstance(urdf, bytes) else urdf.encode())
    with pytest.raises(Findings) as error:
        load_robot(path)
    (one,) = error.value.items
    assert Path(one.source).name == "toy.yaml"
    assert one.line > 1
    return one.message


@pytest.mark.parametrize("case", WRONG)
def test_each_mistake_is_a_line(case: str, tmp_path: Path) -> None:
    right, wrong, words = WRONG[case]
    assert right in URDF
    assert words in finding(tmp_path, URDF.replace(right, wrong, 1))


def test_joints_in_a_circle_are_named(tmp_path: Path) -> None:
    circle = '<joint name="back" type="fixed"><parent link="lower"/><child link="base"/></joint></robot>'
    message = finding(tmp_path, URDF.replace("</robot>", circle))
    found = re.search(r"go round in a circle: ([a-z, ]+);", message)
    assert found
    assert set(found[1].split(", ")) == {"turn", "bend", "back"}


def test_a_picture_is_no_text(tmp_path: Path) -> None:
    assert "toy.urdf is no text; name a URDF file" in finding(tmp_path, b"\x89PNG\r\n\x1a\n\x00\xff")
