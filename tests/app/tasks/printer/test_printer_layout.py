"""Habitat cells whose values cannot be: one line each, with the place in the file."""

from pathlib import Path

import pytest

from regrasp.app.files.findings import Findings
from regrasp.app.files.resources import shipped
from regrasp.app.scenario.cell_file import load_cell


def findings(path: Path) -> list[str]:
    with pytest.raises(Findings) as raised:
        load_cell(path)
    return [str(item).replace(f"{path.parent}/", "") for item in raised.value.items]


def test_the_shipped_cell_is_in_order() -> None:
    load_cell(shipped("cell")["habitat"])


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        ("center: [-0.525, 1.45, 1.18]", "center: [-0.525, 1.75, 1.21]", "desk reaches 0."),
        (
            "center: [-0.555285, 2.54874, 1.4975]",
            "center: [-0.555285, 2.75, 1.4975]",
            "the part is outside the printer's",
        ),
        (
            "center: [-0.555285, 2.54874, 1.4975]",
            "center: [-0.555285, 2.54874, 1.5075]",
            "0.010 m above the plate's top",
        ),
        ("center: [-0.530285, 2.54874, 1.51]", "center: [-0.520285, 2.54874, 1.51]", "0.010 m before the part's front"),
        ("travel: 0.43", "travel: 0.40", "still covers 0.030 m of the opening"),
        ("clamp: {center: [-0.40, 1.35, 1.248]", "clamp: {center: [-1.60, 1.35, 1.248]", "the clamp is 1.97 m from"),
        ("center: [-0.35, 2.549, 1.57]", "center: [-0.37, 2.549, 1.57]", "the door reaches 0.020 m into 'printer_"),
        ("[-0.40, 1.35, 1.248]", "[-0.40, 1.35, 1.18]", "the clamp_left reaches 0.0"),
        ("color: [0.90, 0.60, 0.10]}", "color: [0.85, 0.10, 0.10]}", "'part' has the colour of the door_handle"),
        ("{name: tray_left,", "{name: section,", "'section' is the name of a thing of the printer"),
        ("hand: arm", "hand: left", "no arm on a rail 'left'"),
        ("camera: hand", "camera: head", "no camera on the hand's arm 'head'"),
        ("plate_mass: 0.28", "plate_mass: .nan", "no plain finite number"),
    ],
)
def test_what_cannot_be_is_a_line(tmp_path: Path, before: str, after: str, told: str) -> None:
    source = shipped("cell")["habitat"].read_text()
    assert source.count(before) == 1
    path = tmp_path / "mine.yaml"
    path.write_text(source.replace(before, after))
    line = 1 + next(i for i, text in enumerate(source.splitlines()) if before in text)
    found = findings(path)[0]
    assert told in found
    if "clamp" not in told:
        assert found.startswith(f"mine.yaml:{line}: ")


@pytest.mark.parametrize(
    ("upper", "told"),
    [(0.40, "0.4 m long, and shall draw the door 0.43 m"), (1.0, "the gripping section is 1.46 m from")],
)
def test_a_rail_that_is_too_short_is_a_line(tmp_path: Path, upper: float, told: str) -> None:
    robot = shipped("robot")["ur5e_rail"].read_text()
    (tmp_path / "short.yaml").write_text(
        robot.replace("  upper: 3.2", f"  upper: {upper}").replace("sleep: [0.0,", "sleep: [0.1,")
    )
    source = shipped("cell")["habitat"].read_text().replace("robot: ur5e_rail", "robot: short.yaml")
    path = tmp_path / "mine.yaml"
    path.write_text(source.replace("sleep: [1.75,", "sleep: [0.3,"))
    found = findings(path)
    assert told in found[0]
    assert all(line.startswith("mine.yaml:") for line in found)
