from pathlib import Path

import pytest
from toy_robot import ROBOT, URDF, write_robot

from regrasp.app.files.findings import Findings
from regrasp.app.files.resources import shipped
from regrasp.app.robots.check import check_robot


@pytest.mark.parametrize("name", list(shipped("robot")))
def test_the_shipped_robots_keep_what_their_cover_promises(name: str) -> None:
    measures = check_robot(shipped("robot")[name])
    assert sum(m.spheres for m in measures) > 50
    assert all(m.group for m in measures if m.moves)


def test_a_right_file_has_its_cover_measured(tmp_path: Path) -> None:
    found = {m.link: m for m in check_robot(write_robot(tmp_path))}
    assert {link: m.spheres for link, m in found.items()} == {"base": 0, "upper": 7, "lower": 5, "left": 1, "right": 1}
    assert found["base"].outside is None
    upper = found["upper"]  # a bar of 60 by 60 mm in spheres of 60 mm radius, 50 mm apart; their middles on its axis
    assert upper.outside is not None
    assert -0.015 < upper.outside < 0.0
    assert upper.excess == pytest.approx(0.06, abs=1e-3)  # past its ends


WRONG = {
    "a joint that the URDF has not": (("name: bend", "name: bent"), "- {name: be", ["no joint 'bent'", "'bend'"]),
    "a tool on no link": (
        ("link: lower, xyz", "link: flange, xyz"),
        "tool:",
        ["no link 'flange'", "base, left, lower"],
    ),
    "no such package": (
        ("{path: toy.urdf}", "{package: toy_models, path: a}"),
        "urdf:",
        ["no package 'toy_models' is installed"],
    ),
    "a package of no name": (("{path: toy.urdf}", '{package: "", path: a}'), "urdf:", ["no package '' is installed"]),
    "a module that is no package": (
        ("{path: toy.urdf}", "{package: math, path: a}"),
        "urdf:",
        ["'math' is no package with files"],
    ),
    "a package inside that is not there": (
        ("{path: toy.urdf}", "{package: pybullet_data.gone, path: a}"),
        "urdf:",
        ["'pybullet_data.gone' is no package with files"],
    ),
    "a path upwards": (("{path: toy.urdf}", "{package: .., path: a}"), "urdf:", ["no package '..' is installed"]),
    "no path": (("path: toy.urdf", 'path: ""'), "urdf:", ["has no file ''"]),
    "no such URDF": (("path: toy.urdf", "path: tory.urdf"), "urdf:", ["no file 'tory.urdf'"]),
    "a limit beyond the URDF's": (("lower: -1.5", "lower: -2.5"), "- {name: be", ["lower -2.5 of bend", "URDF's -2;"]),
    "limits in the wrong order": (
        ("lower: -1.5", "lower: 2.5, upper: 1"),
        "- {name: be",
        ["lower 2.5 is not below upper 1"],
    ),
    "a limit above what the URDF leaves": (
        ("lower: -1.5", "lower: 2.5"),
        "- {name: be",
        ["from 2.5 to 2 by file and URDF"],
    ),
    "a pose beyond the limits": (("sleep: [0.0, 1.0]", "sleep: [0.0, 2.1]"), "sleep:", ["2.1 of bend", "-1.5 to 2"]),
    "a pose with a value too few": (("sleep: [0.0, 1.0]", "sleep: [0.0]"), "sleep:", ["1 values", "turn, bend"]),
    "spheres on no link": (("  lower: [[0", "  lover: [[0"), "  lover:", ["no link 'lover'", "'lower'"]),
    "spheres that leave a mesh uncovered": (
        ("0.06], [0, 0, 0.3, 0.06]]", "0.06]]"),
        "  upper:",
        ["spheres that leave a mesh uncovered: upper lies up to", "--links upper"],
    ),
    "a moving link without spheres": (
        ("  left: [[0, 0, 0, 0.03]]\n", ""),
        "spheres:",
        ["left has a mesh", "no spheres"],
    ),
    "spheres that stand out": (
        ("cover: {excess: 0.06}", "cover: {excess: 0.04}"),
        "  upper:",
        ["upper stand out by up to 59.9"],
    ),
    "a joint of the fingers": (
        ("  - {name: bend", "  - {name: left, acceleration: 5.0}\n  - {name: bend"),
        "- {name: left",
        ["left does not move the tool; the URDF's joints from the base to the tool are turn, bend"],
    ),
    "a joint too few": (("  - {name: turn, acceleration: 5.0}\n", ""), "- {name: be", ["turn is missing before bend"]),
    "a joint too few at the end": (
        ("  - {name: bend, acceleration: 5.0, lower: -1.5}\n", ""),
        "joints:",
        ["bend is missing at the end"],
    ),
    "joints in another order": (
        (
            "{name: turn, acceleration: 5.0}",
            "{name: one, urdf: bend, acceleration: 5.0}\n  - {name: turn, acceleration: 1}",
        ),
        "- {name: one",
        ["turn comes before bend"],
    ),
    "no sign": (("{name: bend", "{sign: 2, name: bend"), "- {sign", ["joints.1.sign is 2; expected one of 1, -1"]),
    "a name that is none": (("name: bend", 'name: "j 2;é"'), '- {name: "j', ["expected text such as 'wrist_1'"]),
    "a tool that is turned": (
        ("rpy: [0.0,", "rpy: [0.2,"),
        "tool:",
        ["the tool's y is turned by 11 degrees from the way in which the fingers close"],
    ),
    "a tool off the pads": (
        ("0.0, 0.24]", "0.0, 0.30]"),
        "tool:",
        ["the tool lies 60 mm from the pads' middle", "at [0, 0, 0.24] in lower: correct xyz, rpy (x along the"],
    ),
    "a jaw that opens too far": (
        ("opening: 0.04", "opening: 0.09"),
        "  opening:",
        ["left would stand at 0.054 m", "these pads can be 0 to 0.082 m apart: correct opening or pads"],
    ),
    "pads that always touch": (("face: 0.005", "face: 0.1"), "gripper:", ["correct their face and thickness"]),
    "a finger's face far away": (("face: 0.005", "face: 1.0e+30"), "  pads:", ["gripper.pads.face is 1e+30", "at mo"]),
    "a pad far away": (("ahead: 0.02", "ahead: 1.0e+30"), "  pads:", ["gripper.pads.ahead is 1e+30", "at most 1)"]),
    "a limit far away": (("lower: -1.5", "lower: -1.0e+30"), "- {name: be", ["joints.1.lower is -1e+30", "-100, at"]),
    "a sphere far away": (("[[0, 0, 0.0, 0.05]", "[[0, 0, 1.0e+30, 0.05]"), "  lower: [[", ["spheres.lower.0.2 is 1e"]),
    "a promise of nothing": (("excess: 0.06}", "excess: 1.0e+30}"), "cover:", ["cover.excess is 1e+30", "at most 1)"]),
    "no sleep": (
        ("sleep: [0.0, 1.0]\n", ""),
        "title:",
        ["key 'sleep' is missing; expected a list, each item a number"],
    ),
    "no spheres": ((ROBOT[ROBOT.index("spheres:") :], "spheres: {}\n"), "spheres:", ["no spheres; `regrasp robots sp"]),
    "a promise for no link": (("excess: 0.06}", "links: {uper: {}}}"), "cover:", ["no link 'uper'"]),
}


@pytest.mark.parametrize("case", WRONG)
def test_each_mistake_is_a_line_with_its_place(case: str, tmp_path: Path) -> None:
    (right, wrong), place, words = WRONG[case]
    assert ROBOT.count(right) == 1, right
    text = ROBOT.replace(right, wrong)
    path, line = write_robot(tmp_path, text), text[: text.index(place)].count("\n") + 1
    with pytest.raises(Findings) as error:
        check_robot(path)
    first = error.value.items[0]
    assert (Path(first.source).name, first.line) == ("toy.yaml", line), first
    for word in words:
        assert word in first.message


def test_a_missing_mesh_names_link_and_file(tmp_path: Path) -> None:
    path = write_robot(tmp_path)
    (tmp_path / "upper.stl").unlink()
    with pytest.raises(Findings) as error:
        check_robot(path)
    (finding,) = error.value.items
    assert finding.line == 2
    assert f"the mesh {tmp_path / 'upper.stl'} of the link upper is missing" in finding.message


def test_a_mesh_that_is_none_is_told(tmp_path: Path) -> None:
    path = write_robot(tmp_path)
    (tmp_path / "upper.stl").write_text("no triangles")
    with pytest.raises(Findings) as error:
        check_robot(path)
    (finding,) = error.value.items
    assert (finding.line, "upper" in finding.message) == (2, True)


def test_a_pose_in_which_the_robot_meets_itself_is_told(tmp_path: Path) -> None:
    text = ROBOT.replace("self_collision: []", "self_collision: [[upper, left]]")
    path = write_robot(tmp_path, text.replace("sleep: [0.0, 1.0]", "sleep: [0.0, 3.0]"))
    (tmp_path / "toy.urdf").write_text(URDF.replace('lower="-2" upper="2"', 'lower="-3.1" upper="3.1"'))
    with pytest.raises(Findings) as error:
        check_robot(path)
    assert "the spheres of upper and left overlap by" in error.value.items[0].message


def test_the_same_meeting_in_several_poses_is_told_once(tmp_path: Path) -> None:
    text = ROBOT.replace("self_collision: []", "self_collision: [[upper, left]]").replace("0.0, 1.0]", "0.0, 3.0]")
    path = write_robot(tmp_path, text.replace("[[0.0, 0.0]]", "[[0.0, 3.05], [0.1, 3.1]]"))
    (tmp_path / "toy.urdf").write_text(URDF.replace('lower="-2" upper="2"', 'lower="-3.2" upper="3.2"'))
    with pytest.raises(Findings) as error:
        check_robot(path)
    (found,) = error.value.items
    assert found.line == ROBOT[: ROBOT.index("sleep:")].count("\n") + 1
    assert found.message.startswith("here, and in 2 more poses the spheres of upper and left overlap by ")


def test_what_fits_spheres_names_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = write_robot(tmp_path, ROBOT.replace("  left: [[0, 0, 0, 0.03]]\n", ""))
    with pytest.raises(Findings) as error:
        check_robot(path)
    assert "`regrasp robots spheres toy.yaml --links left` fits them" in error.value.items[0].message


def test_a_wrong_item_does_not_make_its_list_too_short(tmp_path: Path) -> None:
    joints = ROBOT[ROBOT.index("  - {name: turn") : ROBOT.index("tool:")]
    path = write_robot(tmp_path, ROBOT.replace(joints, '  - {name: "j 2", acceleration: 5.0}\n'))
    with pytest.raises(Findings) as error:
        check_robot(path)
    (found,) = error.value.items
    assert found.message.startswith("joints.0.name is 'j 2'; expected text such as 'wrist_1'")


def test_a_package_is_found_without_running_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("ran_alone.py", "ran_whole/__init__.py"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(f"open({str(tmp_path / 'ran')!r}, 'w')")
    monkeypatch.syspath_prepend(str(tmp_path))
    path = write_robot(tmp_path, ROBOT.replace("{path: toy.urdf}", "{package: ran_alone, path: toy.urdf}"))
    with pytest.raises(Findings, match="'ran_alone' is no package with files"):
        check_robot(path)
    for file in (tmp_path / "toy.urdf", tmp_path / "upper.stl"):
        (tmp_path / "ran_whole" / file.name).write_bytes(file.read_bytes())
    path.write_text(ROBOT.replace("{path: toy.urdf}", "{package: ran_whole, path: toy.urdf}"))
    check_robot(path)
    assert not (tmp_path / "ran").exists()


MESH_OF_A_PACKAGE = URDF.replace("upper.stl", "package://toy_parts/meshes/upper.stl")


@pytest.mark.parametrize(
    ("where", "words"),
    [
        ("toy_parts/meshes", "write ros_packages: {toy_parts: toy_parts}"),
        ("elsewhere", "write ros_packages: {toy_parts: FOLDER}, with its path in the robot file's folder"),
    ],
)
def test_where_a_ros_package_lies_is_said(where: str, words: str, tmp_path: Path) -> None:
    path = write_robot(tmp_path)
    (tmp_path / where).mkdir(parents=True)
    (tmp_path / "upper.stl").rename(tmp_path / where / "upper.stl")
    (tmp_path / "toy.urdf").write_text(MESH_OF_A_PACKAGE)
    with pytest.raises(Findings) as error:
        check_robot(path)
    (finding,) = error.value.items
    assert (finding.line, finding.message.endswith(words)) == (2, True), finding


def test_a_ros_package_above_the_urdf_is_said(tmp_path: Path) -> None:
    folder = tmp_path / "toy_parts"
    (folder / "meshes").mkdir(parents=True)
    write_robot(folder / "meshes")
    (folder / "toy.urdf").write_text(MESH_OF_A_PACKAGE)
    path = tmp_path / "toy.yaml"
    path.write_text(ROBOT.replace("path: toy.urdf", "path: toy_parts/toy.urdf"))
    with pytest.raises(Findings, match=r"write ros_packages: \{toy_parts: toy_parts\}$"):
        check_robot(path)


ON_TOP = {  # what a file on top of the toy's says, and the line there, or in the toy's file, of what is wrong
    "its own value": ("tool:\n  rpy: [1.5708, 0.0, 1.5708]\n", ("top.yaml", 3), "the tool's x lies along"),
    "its own place of the tool": ("tool:\n  xyz: [0.0, 0.0, 0.3]\n", ("top.yaml", 3), "the tool lies 60 mm"),
    "a limit against one below": ("joints:\n  1:\n    upper: -1.7\n", ("top.yaml", 4), "lower -1.5 is not below"),
    "a limit against the URDF's": ("joints:\n  0:\n    upper: -4.0\n", ("top.yaml", 4), "turn turns from -3 to -4"),
    "a jaw against one below": ("gripper:\n  closed: 0.05\n", ("top.yaml", 3), "closed 0.05 is not below"),
    "a value below": ("title: Top\n", ("toy.yaml", 16), "bend is beyond its limits"),
}


@pytest.mark.parametrize("case", ON_TOP)
def test_a_finding_stands_where_its_value_does(case: str, tmp_path: Path) -> None:
    text, place, words = ON_TOP[case]
    below = ROBOT.replace("sleep: [0.0, 1.0]", "sleep: [0.0, 2.1]") if place[0] == "toy.yaml" else ROBOT
    write_robot(tmp_path, below)
    path = tmp_path / "top.yaml"
    path.write_text(f"base: toy.yaml\n{text}")
    with pytest.raises(Findings) as error:
        check_robot(path)
    first = error.value.items[0]
    assert (Path(first.source).name, first.line) == place, first
    assert words in first.message


def test_what_is_missing_is_missing_in_the_file_on_top(tmp_path: Path) -> None:
    write_robot(tmp_path, ROBOT[: ROBOT.index("spheres:")])
    path = tmp_path / "top.yaml"
    path.write_text("# a\n# b\nbase: toy.yaml\ntitle: Top\n")
    with pytest.raises(Findings) as error:
        check_robot(path)
    (finding,) = error.value.items
    assert (Path(finding.source).name, finding.message.startswith("no spheres")) == ("top.yaml", True)
