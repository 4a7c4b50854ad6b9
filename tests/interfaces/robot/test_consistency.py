"""What a robot file says against itself or its URDF is a line at the place that says it."""

from pathlib import Path

import pytest
from robots import EVERY
from toy_robot import ROBOT, write_robot

from regrasp.app.files.findings import Findings
from regrasp.app.robots.robot_file import load_robot
from regrasp.interfaces.robot.consistency import inconsistencies

RAIL = "rail: {lower: 0.0, upper: 1.0, speed: 1.0, acceleration: 1.0, force: 9.0, carriage: [1, 1, 1], beam: [1, 1]}\n"
PART = "attached: {urdf: {path: toy.urdf}, at: {link: %s}, prefix: %r}\n"
STILL, PAIRS = "still: [base]", "self_collision: []"
WRONG = {
    "a joint's name twice": ("- {name: bend", "- {name: turn, urdf: bend", "- {name: turn, urdf", "two joints are nam"),
    "a joint named as the rail": (STILL, STILL + "\n" + RAIL.replace("{", "{name: turn, "), "rail:", "a joint 'turn',"),
    "a jaw that does not open": ("opening: 0.04", "opening: 0.04\n  closed: 0.05", "gripper:", "is not below opening"),
    "still: a link that swings": (STILL, "still: [base, lower]", "still:", "lower does not only turn on the spot"),
    "still: no link": (STILL, "still: [bass]", "still:", "no link 'bass'; did you mean 'base'?"),
    "a base that turns": ("base_link: base", "base_link: upper", "base_link:", "upper is moved by turn; name a link"),
    "a base that is no root, on a rail": ("base_link: base", "base_link: upper\n" + RAIL, "base_link:", "is base"),
    "a gripper on no link": (STILL, STILL + "\n" + PART % ("tip", "g_"), "attached:", "the URDF has no link 'tip'; th"),
    "a gripper with the arm's names": (STILL, STILL + "\n" + PART % ("lower", ""), "attached:", "a name in both URDFs"),
    "a mount on no link": (STILL, STILL + "\nmount: {link: uper}", "mount:", "no link 'uper'; did you mean 'upper'?"),
    "a link paired with itself": (PAIRS, "self_collision: [[upper, upper]]", "self_coll", "paired with itself"),
    "a pair twice": (
        PAIRS,
        "self_collision: [[upper, left],\n  [left, upper]]",
        "  [left, upper]",
        "the pair left, upper stands twice",
    ),
    "a promise for no link": ("excess: 0.06}", "links: {uper: {}}}", "cover:", "no link 'uper'; did you mean 'upper'?"),
    "untouchable: no link": (STILL, STILL + "\nuntouchable: [lefd]", "untouch", "no link 'lefd'; did you mean 'left'?"),
    "a folder": (STILL, STILL + "\nfolder: /tmp", "folder:", "unknown key 'folder'; leave it out"),
    "no such drawing": (STILL, STILL + "\ndraw: both", "draw:", "draw: no 'both'; there are collision, visual"),
}


@pytest.mark.parametrize("case", WRONG)
def test_each_is_told_at_its_place(case: str, tmp_path: Path) -> None:
    right, wrong, place, words = WRONG[case]
    assert ROBOT.count(right) == 1, right
    text = ROBOT.replace(right, wrong)
    with pytest.raises(Findings) as error:
        load_robot(write_robot(tmp_path, text))
    (found,) = error.value.items
    assert words in found.message
    assert found.line == text[: text.index(place)].count("\n") + 1


@pytest.mark.parametrize("name", EVERY)
def test_the_robots_of_the_tests_agree_with_themselves(name: str) -> None:
    assert inconsistencies(EVERY[name]) == []


def test_the_key_that_the_reader_sets_is_offered_to_nobody(tmp_path: Path) -> None:
    with pytest.raises(Findings) as error:
        load_robot(write_robot(tmp_path, ROBOT + "colour: red\n"))
    assert "folder" not in str(error.value)


def test_a_file_without_spheres_loads_and_its_base_stands_still(tmp_path: Path) -> None:
    bare = "".join(line for line in ROBOT.splitlines(True) if not line.startswith(("still", "self_collision")))
    robot = load_robot(write_robot(tmp_path, bare[: bare.index("spheres:")]))
    assert (robot.spheres, len(robot.body.links), robot.body.first_moving) == ({}, 0, 1)
