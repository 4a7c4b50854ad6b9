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
from regrasp.app.tasks.cable import TASK
from regrasp.sim.world import World

FOLDER = "faults/"
SCENARIOS = [name.removeprefix(FOLDER) for name in shipped("scenario") if name.startswith(FOLDER)]
REST_SPEED = 0.05  # rad/s: a joint that holds against a swinging cable


def rows() -> dict[str, list[str]]:
    """The table's cells by scenario: fault, begins, notices, does, end."""
    lines = (files("regrasp.scenarios") / "FAULTS.md").read_text(encoding="utf-8").splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]
    return {first: rest for first, *rest in cells[2:]}


def test_the_table_has_every_scenario_and_every_fault() -> None:
    assert sorted(rows()) == sorted(SCENARIOS)
    assert {fault for row in rows().values() for fault in row[0].split(", ")} == set(fault_types(TASK))
    assert {name.removesuffix("_for_good") for name in SCENARIOS} == set(fault_types(TASK))


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_row_says_what_its_scenario_says(name: str) -> None:
    file = load_scenario(FOLDER + name).file
    row = rows()[name]
    assert {fault.type for fault in file.faults} == set(row[0].split(", "))
    assert name.removesuffix("_for_good") in row[0].split(", ")
    cause = f"safe stop: {file.expect.cause}" if file.expect.cause else "stowed"
    assert row[-1] == cause


@pytest.mark.parametrize("name", SCENARIOS)
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
