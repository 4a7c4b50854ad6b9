import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml
from toy_robot import ROBOT, write_robot
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.app.files.resources import shipped
from regrasp.app.robots.check import check_robot


def invoke(*args: str) -> Any:
    return CliRunner().invoke(app, ["robots", *args])


@pytest.fixture(autouse=True)
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return write_robot(tmp_path)


def test_list_tells_the_shipped_robots() -> None:
    lines = invoke("list").stdout.splitlines()
    assert [line.split()[0] for line in lines] == list(shipped("robot"))
    rows = json.loads(invoke("list", "--json").stdout)
    assert {row["name"]: row["joints"] for row in rows} == {"ur5e": 6, "ur5e_rail": 7, "vx300s": 6}


def test_show_tells_limits_tool_and_reach() -> None:
    told = invoke("show", "toy.yaml").stdout
    assert told.startswith("Toy\n")
    (bend,) = [line.split() for line in told.splitlines() if line.startswith("bend")]
    assert bend[1:] == ["-86", "deg", "115", "deg", "115", "deg/s", "286", "deg/s2", "20", "N", "m"]
    assert "0.24 to 0.24 m far from the shoulder" in told


def test_show_of_a_rail_is_in_metres_and_as_json_in_si_units() -> None:
    (rail,) = [line.split() for line in invoke("show", "ur5e_rail").stdout.splitlines() if line.startswith("rail ")]
    assert rail[1:5] == ["0.00", "m", "3.20", "m"]
    data = json.loads(invoke("show", "ur5e_rail", "--json").stdout)
    assert data["joints"][0] | {"torque": 0} == {
        "name": "rail",
        "slides": True,
        "lower": 0.0,
        "upper": 3.2,
        "speed": 0.5,
        "acceleration": 1.0,
        "torque": 0,
    }
    assert data["reach"]["farthest"] == pytest.approx(1.1, abs=0.05)


def test_check_says_ok_with_the_measured_cover() -> None:
    ran = invoke("check", "toy.yaml")
    assert (ran.exit_code, ran.stderr) == (0, "")
    assert ran.stdout == (
        "toy.yaml: ok, 14 spheres leave at most 0.0 mm of a moving link outside and stand out by at most 59.9 mm\n"
    )


def test_check_tells_what_is_wrong_in_each_file(robot: Path) -> None:
    robot.write_text(ROBOT.replace("link: lower, xyz", "link: flange, xyz"))
    ran = invoke("check", "toy.yaml", "gone.yaml")
    assert (ran.exit_code, ran.stdout) == (2, "")
    assert [line.split(" ")[0] for line in ran.stderr.splitlines()] == ["gone.yaml:", "toy.yaml:7:"]


def test_an_unknown_robot_is_a_line() -> None:
    ran = invoke("show", "ur5")
    assert (ran.exit_code, ran.stderr.count("\n")) == (2, 1)
    assert "did you mean 'ur5e'?" in ran.stderr


def test_spheres_make_sections_that_pass_the_check(robot: Path) -> None:
    ran = invoke("spheres", "toy.yaml", "--margin", "0.03", "--margin", "left=0.01")
    assert ran.exit_code == 0, ran.stderr
    assert "left" in ran.stderr
    sections = yaml.safe_load(ran.stdout)
    assert sections["cover"] == {"outside": 0.0, "excess": 0.03, "links": {"left": {"excess": 0.01}}}
    robot.write_text(ROBOT[: ROBOT.index("self_collision")] + ran.stdout)
    measures = {m.link: m for m in check_robot(robot)}
    assert all(m.spheres for m in measures.values())
    assert (measures["left"].excess or 1.0) <= 0.0105


def test_spheres_of_some_links_leave_the_others(tmp_path: Path) -> None:
    ran = invoke("spheres", "toy.yaml", "--links", "l*", "--out", "made.yaml")
    assert (ran.exit_code, ran.stdout) == (0, "")
    assert set(yaml.safe_load((tmp_path / "made.yaml").read_text())["spheres"]) == {"lower", "left"}


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("--margin", "2", "'2' is no margin; write metres"),
        ("--margin", "left=", "'left=' is no margin"),
        ("--margin", "lefty=0.01", "no link of the robot is named 'lefty'; did you mean 'left'?"),
        ("--links", "uper", "did you mean 'upper'?"),
    ],
)
def test_wrong_options_are_a_line(option: str, value: str, words: str) -> None:
    ran = invoke("spheres", "toy.yaml", option, value)
    assert (ran.exit_code, ran.stderr.count("\n")) == (2, 1)
    assert words in ran.stderr


def test_a_missing_mesh_ends_the_fit_with_a_line(tmp_path: Path) -> None:
    (tmp_path / "upper.stl").unlink()
    ran = invoke("spheres", "toy.yaml")
    assert (ran.exit_code, ran.stderr.count("\n")) == (2, 1)
    assert ran.stderr.startswith("toy.yaml:2: the mesh ")


def test_a_picture_shows_the_robot_and_its_spheres(tmp_path: Path) -> None:
    file = tmp_path / "pictures" / "ur5e.png"
    shown = invoke("show", "ur5e", "--picture", str(file))
    assert shown.exit_code == 0, shown.output
    picture = cv2.imread(str(file))
    assert picture is not None
    robot, spheres = np.split(picture.astype(int), 2, axis=1)
    drawn = [np.abs(half - half[0, 0]).sum(axis=2) > 30 for half in (robot, spheres)]  # what is no background
    assert drawn[0].mean() > 0.05
    assert drawn[1][drawn[0]].mean() > 0.98  # the spheres cover it


def test_a_picture_shows_the_tool_s_frame(tmp_path: Path) -> None:
    assert invoke("show", "toy.yaml", "--picture", "toy.png").exit_code == 0
    picture = cv2.imread(str(tmp_path / "toy.png"))
    assert picture is not None
    half = picture[:, : picture.shape[1] // 2].astype(int)
    blue, green, red = (half[..., i] - np.delete(half, i, axis=2).max(axis=2) > 60 for i in range(3))
    assert min(blue.sum(), green.sum(), red.sum()) > 20


def test_a_large_sphere_is_drawn_and_leaves_the_picture_s_frame(tmp_path: Path, robot: Path) -> None:
    drawn = []
    for rows in ("", "  base: [[0, 0, -0.5, 0.5]]\n"):
        robot.write_text(ROBOT + rows)
        assert invoke("show", "toy.yaml", "--picture", "toy.png").exit_code == 0
        picture = cv2.imread(str(tmp_path / "toy.png"))
        assert picture is not None
        drawn.append(picture)
    left, right = (np.abs(half).max(axis=2) > 3 for half in np.split(drawn[1].astype(int) - drawn[0], 2, axis=1))
    assert not left.any()
    assert right.mean() > 0.1


def test_a_picture_of_a_robot_without_spheres_shows_the_robot_alone(tmp_path: Path, robot: Path) -> None:
    robot.write_text(ROBOT[: ROBOT.index("spheres:")])
    ran = invoke("show", "toy.yaml", "--picture", "toy.png")
    assert ran.exit_code == 0, ran.output
    picture = cv2.imread(str(tmp_path / "toy.png"))
    assert picture is not None
    drawn = [np.abs(half - half[0, 0]).max() > 30 for half in np.split(picture.astype(int), 2, axis=1)]
    assert drawn == [True, False]


@pytest.mark.parametrize("name", ["toy.jpg", "toy", "toy.yaml"])
def test_a_picture_that_is_no_png_is_refused(tmp_path: Path, name: str) -> None:
    before = {file: file.read_bytes() for file in tmp_path.iterdir()}
    ran = invoke("show", "toy.yaml", "--picture", name)
    assert (ran.exit_code, ran.stdout) == (2, "")
    assert ran.stderr == f"--picture: '{name}' is no PNG file; write a name with .png\n"
    assert {file: file.read_bytes() for file in tmp_path.iterdir()} == before


@pytest.mark.parametrize("place", ["toy.urdf/a.yaml", "/proc/a/b.yaml", "folder"])
def test_where_nothing_can_be_written_is_told_before_the_fit(tmp_path: Path, place: str) -> None:
    (tmp_path / "folder").mkdir()
    ran = invoke("spheres", "toy.yaml", "-o", place)
    assert (ran.exit_code, ran.stderr.count("\n")) == (2, 1), ran.stderr
    assert ran.stderr.startswith(f"{place}: ")


def test_folders_on_the_way_to_the_spheres_are_made(tmp_path: Path) -> None:
    ran = invoke("spheres", "toy.yaml", "--links", "left", "-o", "some/where/made.yaml")
    assert ran.exit_code == 0, ran.output
    assert "left" in yaml.safe_load((tmp_path / "some/where/made.yaml").read_text())["spheres"]


def test_spheres_are_fitted_to_a_file_that_has_none(robot: Path) -> None:
    first = "".join(line for line in ROBOT.splitlines(True) if not line.startswith(("still", "self_coll", "cover")))
    robot.write_text(first[: first.index("spheres:")])
    ran = invoke("check", "toy.yaml")
    assert (ran.exit_code, ran.stderr) == (2, "toy.yaml:1: no spheres; `regrasp robots spheres toy.yaml` fits them\n")
    ran = invoke("spheres", "toy.yaml", "--margin", "0.03", "-o", "made.yaml")
    assert ran.exit_code == 0, ran.output
    assert ran.stderr.endswith("\nmade.yaml: put its sections into toy.yaml\n")
    robot.write_text(robot.read_text() + Path("made.yaml").read_text())
    assert invoke("check", "toy.yaml").exit_code == 0
