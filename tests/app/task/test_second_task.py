"""A second task, in tests/second_task, that no file of the engine knows: run, explained, told from the first."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parents[2] / "second_task"
PRESS = str(HERE / "press.yaml")
LINES = 250  # choice: what a task may cost that is to be tried in an afternoon


def regrasp(*arguments: str, folder: Path | None = None) -> subprocess.CompletedProcess[str]:
    """The command line, with the second task installed, and what is in `folder`."""
    path = os.pathsep.join(filter(None, (str(HERE), str(folder or ""), os.environ.get("PYTHONPATH"))))
    return subprocess.run(
        [sys.executable, "-m", "regrasp", *arguments],
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        timeout=300,
    )


def test_it_is_small() -> None:
    files = (path for path in HERE.iterdir() if path.suffix in (".py", ".yaml", ".xml"))
    assert sum(len(path.read_text(encoding="utf-8").splitlines()) for path in files) <= LINES


def test_a_lit_button_is_pressed_and_told_of(tmp_path: Path) -> None:
    ran = regrasp("run", PRESS, "--quiet", "--out", str(tmp_path / "run"))
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "✓ pressed: True (expected: True)" in ran.stdout
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert (result["task"], result["outcome"]) == ("button", "success")
    assert 0 < result["measured"]["pressed_at"] < result["sim_seconds"]
    page = regrasp("explain", str(tmp_path / "run")).stdout
    assert "The button, by ground truth\n  pressed_at: " in page
    assert "solo arm: tool at (" in page
    again = regrasp("run", str(tmp_path / "run" / "scenario.yaml"), "--quiet", "--out", str(tmp_path / "again"))
    assert again.returncode == 0, again.stderr
    assert (tmp_path / "again" / "ticks.jsonl").read_bytes() == (tmp_path / "run" / "ticks.jsonl").read_bytes()


def test_a_fault_of_its_own_ends_it_with_a_cause_of_its_own(tmp_path: Path) -> None:
    dark = "faults=[{type: button_goes_dark, when: {at: [0, 0]}}]"
    expect = "expect={outcome: failure, cause: button_dark, pressed: false}"
    ran = regrasp("run", PRESS, "--quiet", "--set", dark, "--set", expect, "--out", str(tmp_path / "run"))
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "cause   button_dark: no lit button in 2 s (touch/job/find)" in ran.stdout


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ("expect.slips=1", "expect.slips is judged by the task cable, and this scenario's is button; there are"),
        (
            "faults=[{type: cable_snags, when: {at: [1, 2]}}]",
            "'cable_snags' is a fault of the task cable, and this scenario's is button",
        ),
        (
            "faults=[{type: jaw_opens, arm: solo, when: {phase: lost}}]",
            "faults.0.when.phase is of the task cable, and this scenario's is button; there are after, at, node",
        ),
        (
            "expect={outcome: failure, cause: slipped}",
            "expect.cause: 'slipped' is a cause of the task cable, and this scenario's is button",
        ),
        ("tree=recovery", "is a leaf of the task cable, and the scenario's task is button"),
        ("task=buton", "no task 'buton'; did you mean 'button'?"),
        ("faults=[{type: jaw_opens, when: {at: [1, 2]}}]", "no arm 'right'; there are solo"),
        ("faults=[{type: camera_dark, camera: rear, when: {at: [1, 2]}}]", "no camera 'rear'; there are ceiling"),
    ],
)
def test_what_is_another_tasks_is_told_in_one_line(change: str, told: str) -> None:
    checked = regrasp("scenarios", "check", PRESS, "--set", change)
    [line] = checked.stderr.splitlines()
    assert checked.returncode == 2
    assert told in line


def test_a_cell_without_the_tasks_section_is_told_which_has_one(tmp_path: Path) -> None:
    checked = regrasp("scenarios", "check", "no_obstacle", "--set", f"cell={HERE / 'cell.yaml'}", "--set", "task=cable")
    assert checked.returncode == 2
    assert (
        "the task cable needs a section known.cable, and this cell has none; take the cell 'thesis'" in checked.stderr
    )
    (tmp_path / "cell.yaml").write_text((HERE / "cell.yaml").read_text().replace("  button:", "  buton:"))
    checked = regrasp("scenarios", "check", PRESS, "--set", f"cell={tmp_path / 'cell.yaml'}")
    [line] = checked.stderr.splitlines()
    assert "has no task's section; add that of your task, known.NAME, or write task: with one of button, cable" in line


def test_a_tree_of_two_tasks_leaves_is_told_without_a_scenario(tmp_path: Path) -> None:
    text = (HERE / "tree.xml").read_text().replace('<Press name="press"/>', '<Holding name="holding"/>')
    (tmp_path / "tree.xml").write_text(text)
    checked = regrasp("trees", "check", str(tmp_path / "tree.xml"))
    assert checked.returncode == 2
    assert (
        "Holding 'holding' is a leaf of the task cable, and FindButton of line 6 one of the task button"
        in checked.stderr
    )


def test_what_needs_a_key_that_nothing_writes_is_told(tmp_path: Path) -> None:
    (tmp_path / "tree.xml").write_text(
        (HERE / "tree.xml").read_text().replace('<FindButton name="find" seconds="2.0"/>', "")
    )
    checked = regrasp("trees", "check", str(tmp_path / "tree.xml"))
    [line] = checked.stderr.splitlines()
    assert "Press 'press' needs button/place" in line
    assert "FindButton" in line


def test_a_check_brings_no_simulation() -> None:
    checked = regrasp("scenarios", "check", PRESS)
    assert (checked.returncode, checked.stderr) == (0, "")  # PyBullet would greet there


BROKEN = {
    "no task": ("TASK = 3", "the task broken cannot be loaded: it is int, not a regrasp.app.task.task.Task"),
    "does not import": ("import nowhere", "ModuleNotFoundError: No module named 'nowhere'; mend its package"),
    "ends the program": ("raise SystemExit(5)", "SystemExit: 5; mend its package"),
    "has another name": (
        "from regrasp.app.task.task import Task\nTASK = Task(name='other', about='')",
        "its entry point is named broken, and itself 'other'",
    ),
    "has a part that is missing": (
        "from regrasp.app.task.part import Part\nfrom regrasp.app.task.task import Task\n"
        "TASK = Task(name='broken', about='', expect=Part('broken:Nope'), commands=Part('broken:nope'))",
        "broken:Nope: this part of a task cannot be loaded: AttributeError",
    ),
}


_QUICK = "does not import"  # the others end in the same place


@pytest.mark.parametrize("kind", [pytest.param(k, marks=[pytest.mark.slow] if k != _QUICK else []) for k in BROKEN])
def test_a_broken_task_is_told_and_stops_no_other(tmp_path: Path, kind: str) -> None:
    module, told = BROKEN[kind]
    (tmp_path / "broken-1.0.dist-info").mkdir()
    (tmp_path / "broken-1.0.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: broken\nVersion: 1.0\n")
    entry = "[regrasp.tasks]\nbroken = broken:TASK\n"
    (tmp_path / "broken-1.0.dist-info" / "entry_points.txt").write_text(entry)
    (tmp_path / "broken.py").write_text(module)
    right = regrasp("scenarios", "check", "no_obstacle", "--set", "expect.slipps=1", folder=tmp_path)
    assert "unknown key 'slipps'; did you mean 'slips'?" in right.stderr
    assert "Traceback" not in right.stderr
    wrong = regrasp("scenarios", "check", PRESS, "--set", "task=broken", folder=tmp_path)
    assert wrong.returncode == 2
    assert told in wrong.stderr
    assert "Traceback" not in wrong.stderr


def test_two_packages_with_one_task_are_told(tmp_path: Path) -> None:
    (tmp_path / "twice-1.0.dist-info").mkdir()
    (tmp_path / "twice-1.0.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: twice\nVersion: 1.0\n")
    entry = "[regrasp.tasks]\nbutton = twice:TASK\n"
    (tmp_path / "twice-1.0.dist-info" / "entry_points.txt").write_text(entry)
    checked = regrasp("scenarios", "check", PRESS, folder=tmp_path)
    assert checked.returncode == 2
    assert "2 packages put it in, " in checked.stderr


def test_another_robot_presses_it_by_one_change_of_the_cell(tmp_path: Path) -> None:
    change = "cell.known.arms.0.robot=ur5e"
    ran = regrasp("run", PRESS, "--quiet", "--set", change, "--out", str(tmp_path / "run"))
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "✓ pressed: True (expected: True)" in ran.stdout


THREE_ARMS = f"""
base: {HERE / "cell.yaml"}
known:
  arms:
    - {{name: solo, robot: ur5e_rail, base: [0.1, -1.2, 1.3], base_rpy_deg: [0.0, 180.0, 0.0]}}
    - {{name: left, robot: vx300s, base: [0.0, 0.8, 0.0]}}
    - {{name: right, robot: vx300s, base: [0.0, -0.8, 0.0]}}
"""


def test_an_arm_that_hangs_from_a_rail_presses_it_between_two_of_another_kind(tmp_path: Path) -> None:
    (tmp_path / "cell.yaml").write_text(THREE_ARMS, encoding="utf-8")
    change = f"cell={tmp_path / 'cell.yaml'}"
    ran = regrasp("run", PRESS, "--quiet", "--set", change, "--out", str(tmp_path / "run"))
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "✓ pressed: True (expected: True)" in ran.stdout
    page = regrasp("explain", str(tmp_path / "run")).stdout
    rail = next(line for line in page.splitlines() if line.strip().startswith("joints")).split("(")[1].split(",")[0]
    assert float(rail) > 0.5  # the base stands 1.2 m beside the button, farther than the arm reaches
