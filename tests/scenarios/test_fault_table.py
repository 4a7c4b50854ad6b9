"""Every row of scenarios/FAULTS.md, in a real world: the fault comes, and the run ends as the row says."""

import json
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from regrasp.app.files.resources import shipped
from regrasp.app.run.episode import run_episode
from regrasp.app.scenario.load import load_scenario
from regrasp.app.scenario.schema import fault_types
from regrasp.app.tasks import cable, printer
from regrasp.sim.world import World

FOLDER = "faults/"
SCENARIOS = [name.removeprefix(FOLDER) for name in shipped("scenario") if name.startswith(FOLDER)]
REST_SPEED = 0.05  # rad/s: a joint that holds against a swinging cable


def rows() -> dict[str, list[str]]:
    """The tables' cells by scenario: fault, begins, notices, does, end."""
    lines = (files("regrasp.scenarios") / "FAULTS.md").read_text(encoding="utf-8").splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]
    return {first: rest for first, *rest in cells if first != "scenario" and set(first) != {"-"}}


def test_the_table_has_every_scenario_and_every_fault() -> None:
    assert sorted(rows()) == sorted(SCENARIOS)
    told = {fault for row in rows().values() for fault in row[0].split(", ")}
    assert told == set(fault_types(cable.TASK)) | set(fault_types(printer.TASK))
    assert {name.removesuffix("_for_good") for name in SCENARIOS} >= told


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_row_says_what_its_scenario_says(name: str) -> None:
    scenario, row = load_scenario(FOLDER + name), rows()[name]
    file = scenario.file
    assert {fault.type for fault in file.faults} == set(row[0].split(", "))
    expected = file.expect.model_dump()
    ends = {"part_in_tray": "part in tray", "part_held": "part held", "door_open": "door open"}
    of_printer = next((end for key, end in ends.items() if expected.get(key)), "")
    job_done = of_printer if scenario.task is printer.TASK else "stowed"
    assert row[-1] == (f"safe stop: {file.expect.cause}" if file.expect.cause else job_done)


# Whole runs that are alike to another row's: a jaw that loses the end, a camera that is blind, a way that is not found.
SLOW = {
    *("bond_breaks", "camera_dark", "camera_loses_depth", "jaw_stuck", "jaw_weakens", "joint_lags", "light_changes"),
    *("door_closes", "door_jams", "jaw_opens"),  # the last is what the demonstrations show
    *(
        "cable_snags",
        "camera_freezes",
        "camera_dark_for_good",
        "part_drifts",
        "part_slips",
        "plate_sticks",
        "plate_sticks_for_good",
        "planning_finds_nothing",
        "printer_dark",
    ),
    *(
        "connector_knocked",
        "desk_occupied",
        "handle_moves",
        "obstacle_moves_in",
        "rail_stalls_for_good",
        "service_raises",
    ),
}


@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.slow] if n in SLOW else []) for n in SCENARIOS])
def test_it_ends_as_its_row_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    speeds: list[float] = []
    close = World.close

    def watched(world: World[Any]) -> None:
        speeds.extend(float(np.abs(arm.reading().velocities).max()) for arm in world.arms.values())
        close(world)

    monkeypatch.setattr(World, "close", watched)
    scenario = load_scenario(FOLDER + name)
    result = run_episode(scenario, tmp_path / "run", seed=0)
    events: list[dict[str, Any]] = [json.loads(line) for line in (tmp_path / "run/events.jsonl").open()]
    told = "\n".join([result.to_json(), *(json.dumps(e) for e in events if e["level"] != "info")])
    assert result.succeeded, told
    began = [event["fault"] for event in events if event["event"] == "fault began"]
    assert sorted(began) == sorted(fault.type for fault in scenario.file.faults)
    assert max(speeds) < REST_SPEED
