"""The habitat's jobs, end to end. Their faults are rows of `test_fault_table.py`."""

import json
from pathlib import Path
from typing import Any

import pytest
import yaml
from typer.testing import CliRunner

import regrasp
from regrasp.app.cli.commands import app
from regrasp.app.files.findings import Findings
from regrasp.app.files.resources import shipped
from regrasp.app.scenario.load import load_scenario


def run(changes: list[str], folder: Path, seed: int = 3) -> Any:
    return regrasp.run(load_scenario("printer_door", changes), seed=seed, out=folder / "run")


@pytest.mark.parametrize("gravity", ["earth", pytest.param("zero", marks=pytest.mark.slow)])
def test_the_door_is_opened_by_its_handle(gravity: str, tmp_path: Path) -> None:
    result = run([f"gravity={gravity}"], tmp_path)
    assert result.succeeded, [str(e) for e in result.expectations]
    assert result.measured["door_open"] == pytest.approx(0.42, abs=0.01)
    assert result.sim_seconds < 30.0


def test_a_handle_that_is_not_where_the_robot_believes_it_is_found_by_looking(tmp_path: Path) -> None:
    cell = yaml.safe_load(shipped("cell")["habitat"].read_text(encoding="utf-8"))
    cell["hidden"]["printer"]["handle_off"] = [0.02, -0.015]
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump(cell))
    result = run([f"cell={tmp_path / 'cell.yaml'}"], tmp_path)
    assert result.succeeded, [str(e) for e in result.expectations]
    events = map(json.loads, (tmp_path / "run" / "events.jsonl").read_text().splitlines())
    off = next(event["off"] for event in events if event["event"] == "saw the handle")
    assert off == pytest.approx([0.0, 0.02, -0.015], abs=6e-3)  # as far as arm and camera are off


def test_the_same_seed_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("one", "two"):
        run([], tmp_path / name)
    one, two = (tmp_path / name / "run" / "ticks.jsonl" for name in ("one", "two"))
    assert one.read_bytes() == two.read_bytes()


@pytest.mark.parametrize("approach", ["servo", "three_step"])
def test_the_part_is_taken_by_each_approach(approach: str, tmp_path: Path) -> None:
    scenario = load_scenario("printer_grasp", ["gravity=earth", f"inputs.approach={approach}"])
    result = regrasp.run(scenario, seed=4, out=tmp_path / "run")
    assert result.succeeded, [str(e) for e in result.expectations]
    assert result.measured["part_held"] is True


CLOSING = """<root main_tree_to_execute="Closing">
  <BehaviorTree ID="Closing">
    <Sequence name="closing" memory="true">
      <MoveGripper name="fit_handle" gap="0.05"/>
      <RailToHandle name="rail_to_handle" beside="-0.2"/>
      <LookAtHandle name="look_at_handle" standoff="0.20" seconds="1.0"/>
      <ReachHandle name="arm_to_handle" standoff="0.08"/>
      <GripHandle name="close_on_handle"/>
      <SlideDoor name="rail_with_door" opening="0.0"/>
    </Sequence>
  </BehaviorTree>
</root>"""


def test_a_grip_that_strains_the_arm_does_not_stop_the_door(tmp_path: Path) -> None:
    """As the handle slides between the pads, what they strained the arm with as they closed is let go at once."""
    (tmp_path / "closing.xml").write_text(CLOSING)
    (tmp_path / "closing.yaml").write_text(
        "description: Close the door.\ncell: habitat_open\ntree: closing.xml\ngravity: zero\n"
        "expect: {outcome: success, door_closed: true}\n"
    )
    result = regrasp.run(load_scenario(str(tmp_path / "closing.yaml")), seed=711, out=tmp_path / "run")
    assert result.succeeded, [str(e) for e in result.expectations]


@pytest.mark.parametrize("gravity", ["zero", pytest.param("earth", marks=pytest.mark.slow)])
def test_the_whole_job_is_done_as_it_was_planned(gravity: str, tmp_path: Path) -> None:
    scenario = load_scenario("printer_part", [f"gravity={gravity}", "cell=habitat_open"])
    result = regrasp.run(scenario, seed=4, out=tmp_path / "run")
    assert result.succeeded, [str(e) for e in result.expectations]
    told = CliRunner().invoke(app, ["explain", str(tmp_path / "run")]).stdout
    plan = "take_part draw_out look_at_desk put_into_clamp grip_part twist_off put_into_tray close_door"
    assert f"planned: because=the task begins, actions={plan}" in " ".join(told.split())


def test_a_plate_that_does_not_come_out_is_left_in_the_printer_with_its_part(tmp_path: Path) -> None:
    """Pads that were drawn on slid off the section, and twisted the part off its plate (seed 7)."""
    scenario = load_scenario("faults/plate_sticks_for_good")
    result = regrasp.run(scenario, seed=7, out=tmp_path / "run")
    assert result.succeeded, [str(e) for e in result.expectations]
    pulls = [line for line in (tmp_path / "run/events.jsonl").open() if '"plate_stuck"' in line and "draw_out" in line]
    assert len([line for line in pulls if '"of"' not in line]) == 2
    assert result.measured["part_held"] is False


def test_a_part_that_does_not_come_off_its_plate_is_left_there(tmp_path: Path) -> None:
    strong = [f"cell.hidden.printer.bond.{way}=500" for way in ("twist", "shear", "tilt", "normal")]
    scenario = load_scenario("printer_part", ["gravity=zero", "cell=habitat_open", "inputs.replans=1", *strong])
    result = regrasp.run(scenario, seed=3, out=tmp_path / "run")
    assert result.cause is not None
    assert (result.outcome, result.cause.code) == ("failure", "bond_holds")
    assert result.measured["plate_in_clamp"] is True
    assert next(e for e in result.expectations if e.name == "unintended_force").met


def test_an_approach_that_there_is_not_is_found_by_the_check(tmp_path: Path) -> None:
    tree = shipped("tree")["printer_grasp"].read_text(encoding="utf-8").replace('method="{approach}"', 'method="two"')
    (tmp_path / "mine.xml").write_text(tree)
    text = (
        shipped("scenario")["printer_grasp"]
        .read_text(encoding="utf-8")
        .replace("tree: printer_grasp", "tree: mine.xml")
    )
    (tmp_path / "mine.yaml").write_text(text)
    with pytest.raises(Findings, match="two_step"):
        load_scenario(str(tmp_path / "mine.yaml"))
