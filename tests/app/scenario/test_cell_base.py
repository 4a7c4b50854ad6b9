"""Cells that rest on another."""

from pathlib import Path

import pytest
from robots import OWN, VX300S

from regrasp.app.files.findings import Findings
from regrasp.app.files.resources import shipped
from regrasp.app.scenario.load import load_scenario
from regrasp.app.tasks.cable.cells import cable_cell


def cell(folder: Path, text: str) -> Path:
    path = folder / "mine.yaml"
    path.write_text(text)
    return path


def findings(path: Path) -> list[str]:
    with pytest.raises(Findings) as raised:
        cable_cell(path)
    return [str(item).replace(f"{path.parent}/", "") for item in raised.value.items]


def test_the_tagged_cell_is_the_thesiss_with_two_tags() -> None:
    plain, tagged = (cable_cell(shipped("cell")[name]) for name in ("thesis", "thesis_tags"))
    connector, clip = tagged.known.cable.connector, tagged.known.cable.clip
    assert connector.tag is not None
    assert clip.tag is not None
    assert connector.tag.number != clip.tag.number
    bare = {"connector": connector.model_copy(update={"tag": None}), "clip": clip.model_copy(update={"tag": None})}
    assert tagged.model_copy(update={"known": tagged.known.with_cable(**bare)}) == plain


def test_mappings_are_joined_and_lists_replaced(tmp_path: Path) -> None:
    box = "{name: back_panel, center: [1, 0, 0], size: [1, 1, 1]}"
    text = f"base: thesis\nknown:\n  cable: {{connector: {{radius: 0.012}}}}\n  boxes:\n    - {box}\n"
    plain, mine = cable_cell(shipped("cell")["thesis"]), cable_cell(cell(tmp_path, text))
    assert mine.known.cable.connector == plain.known.cable.connector.model_copy(update={"radius": 0.012})
    assert [box.name for box in mine.known.boxes] == ["back_panel"]
    assert mine.hidden == plain.hidden


def test_a_base_may_be_a_file_beside_the_cell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "below.yaml").write_text(shipped("cell")["thesis"].read_text())
    path = cell(tmp_path, "base: below.yaml\nknown: {cable: {length: 0.5}}\n")
    monkeypatch.chdir("/")
    assert cable_cell(path).known.cable.length == 0.5


def test_a_robot_without_spheres_is_no_cell_s(tmp_path: Path) -> None:
    panda = (OWN / "panda.yaml").read_text()
    (tmp_path / "bare.yaml").write_text(panda[: panda.index("spheres:")])
    arms = "".join(
        f"    - {{name: {name}, robot: bare.yaml, base: [0, {y}, 0]}}\n" for name, y in (("left", 1), ("right", 0))
    )
    assert findings(cell(tmp_path, f"base: thesis\nknown:\n  arms:\n{arms}")) == [
        f"mine.yaml:{line}: known.arms.{i}.robot: Franka Emika Panda has no spheres; `regrasp robots spheres` fits them"
        for i, line in enumerate((4, 5))
    ]


def test_what_is_wrong_is_told_where_it_stands(tmp_path: Path) -> None:
    source = shipped("cell")["thesis"].read_text()
    (tmp_path / "below.yaml").write_text(source.replace("    length: 0.513", "    length: long"))
    line = 1 + next(i for i, text in enumerate(source.splitlines()) if "length: 0.513" in text)
    text = "base: below.yaml\nknown:\n cable:\n  connector: {radius: -1, tag: {number: 50, size: 1e3}}\n  clip: 3\n"
    assert findings(cell(tmp_path, text)) == [
        f"below.yaml:{line}: known.cable.length is 'long'; "
        "expected a number in metres, such as 0.3 (at least 0.0001, at most 10)",
        "mine.yaml:4: '1e3' is text to YAML, not a number; write 1.0e+3",
        "mine.yaml:4: key 'center' is missing in known.cable.connector.tag; "
        "expected 3 values, each a number in metres, such as 0.3 (at least -5, at most 5)",
        "mine.yaml:4: key 'plate' is missing in known.cable.connector.tag; "
        "expected a number (at least 0.0001, at most 10)",
        "mine.yaml:4: known.cable.connector.radius is -1; "
        "expected a number in metres, such as 0.3 (at least 0.0001, at most 10)",
        "mine.yaml:4: known.cable.connector.tag.number is 50; expected a whole number (at least 0, at most 49)",
        "mine.yaml:5: known.cable.clip is 3; "
        "expected a mapping of seat, axis, capture_distance, capture_angle_deg, hold_force, bracket, tag",
    ]


@pytest.mark.parametrize(
    ("base", "told"),
    [
        ("thesi", "mine.yaml:1: no cell named 'thesi'; did you mean 'thesis'? (a path ends in .yaml)"),
        ("gone.yaml", "mine.yaml:1: 'gone.yaml' does not exist; name a file"),
        ("3", "mine.yaml:1: base is 3; expected the name of a cell or a path to its file"),
        ("", "mine.yaml:1: base is None; expected the name of a cell or a path to its file"),
        ("thesis_tags", "thesis_tags.yaml' has a base itself; name that one, and give here what it adds"),
    ],
)
def test_a_wrong_base_is_a_finding(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, base: str, told: str) -> None:
    monkeypatch.chdir(tmp_path)
    assert findings(cell(tmp_path, f"base: {base}\n"))[0].endswith(told)


def test_a_robot_s_path_from_the_command_line_is_one_from_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mine.yaml").write_text("base: vx300s\ntitle: Mine\n")
    monkeypatch.chdir(tmp_path)
    scenario = load_scenario("no_obstacle", ["cell.known.arms.0.robot=mine.yaml"])
    assert [arm.robot.title for arm in scenario.cell.known.arms] == ["Mine", VX300S.title]
