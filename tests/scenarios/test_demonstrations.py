"""The shipped demonstrations, end to end."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from regrasp.app.records.folders import FILES
from regrasp.app.records.result import Result
from regrasp.app.run.episode import run_episode
from regrasp.app.run.observers import Observers
from regrasp.app.scenario.load import load_scenario
from regrasp.sim.world import World

REST_SPEED = 0.05  # rad/s: a joint that holds against a swinging cable
FIELDS = [
    *(
        "schema",
        "scenario",
        "seed",
        "outcome",
        "succeeded",
        "task",
        "case",
        "cause",
        "chain",
        "traceback",
        "expectations",
    ),
    *("measured", "sim_seconds", "wall_seconds", "real_time_factor", "wall_by_part", "longest_tick"),
    *("renderer", "versions", "belief", "attempts"),
]
STATES = {"unplug", "monitor", "detect_slip", "carry", "insert", "check_cameras", "regrasp", "stow", "let_go"}
EXPECTED = {"outcome", "end", "slips", "unintended_force"}


def lines(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text().splitlines()]


def own_name(line: dict[str, Any]) -> str:
    return str(line["path"]).rsplit("/", 1)[-1]


def told(folder: Path, result: Result) -> str:
    """What went wrong, for whoever reads the failure."""
    events = [e for e in lines(folder / "events.jsonl") if e["level"] != "info" or "slip" in e["event"]]
    return "\n".join([result.to_json(), *(json.dumps(e) for e in events)])


def check_result(folder: Path, scenario: str, expected: set[str]) -> None:
    """result.json has what a reader asks of it, and says that all came out."""
    read = json.loads((folder / "result.json").read_text())
    assert list(read) == FIELDS
    assert (read["schema"], read["scenario"], read["seed"]) == (3, scenario, 0)
    assert (read["outcome"], read["succeeded"], read["cause"]) == ("success", True, None)
    assert {e["name"] for e in read["expectations"]} == expected
    assert all(set(e) == {"name", "met", "value", "limit"} and e["met"] is True for e in read["expectations"])
    assert read["chain"] is None
    assert {own_name(attempt) for attempt in read["attempts"]} >= {"unplug", "detect_slip", "regrasp", "let_go"}
    assert read["measured"]["slips"]
    for slip in read["measured"]["slips"]:
        assert set(slip) == {"released_at", "detected_at", "detected_by"}
        assert 0 < slip["released_at"] <= slip["detected_at"] < read["sim_seconds"]
        assert slip["detected_by"] in {"distance", "gap", "place"}
    assert read["real_time_factor"] == pytest.approx(read["sim_seconds"] / read["wall_seconds"])
    assert read["renderer"] in {"moderngl", "software"}
    assert {"python", "numpy", "pybullet", "py_trees", "ompl"} <= set(read["versions"])


def check_ticks(folder: Path, states: set[str]) -> None:
    """The log knows the thesis's states by name, and the slip takes the arm from the carrying in its own tick."""
    ticks = lines(folder / "ticks.jsonl")
    assert [line["t"] for line in ticks] == sorted(line["t"] for line in ticks)
    visited = {own_name(line) for line in ticks if line["status"] in {"RUNNING", "SUCCESS", "FAILURE"}}
    assert states <= visited
    assert ("spiral_search" in visited) == ("spiral_search" in states)
    slipped = next(line["t"] for line in ticks if own_name(line) == "detect_slip" and line["status"] == "FAILURE")
    before = [line for line in ticks if own_name(line) == "carry" and line["t"] < slipped]
    assert before[-1]["status"] == "RUNNING"
    at_once = [line["status"] for line in ticks if own_name(line) == "carry" and line["t"] == slipped]
    assert at_once == ["INVALID"]
    resumed = next(line["t"] for line in ticks if own_name(line) == "regrasp" and line["status"] == "SUCCESS")
    assert slipped < resumed
    assert {own_name(line): line["status"] for line in ticks if line["t"] == ticks[-1]["t"]}["stow"] == "SUCCESS"


@pytest.mark.parametrize(
    ("scenario", "gravity", "states", "expected"),
    [
        ("no_obstacle", "zero", STATES, EXPECTED),
        pytest.param(
            *("short_obstacle", "earth", STATES | {"spiral_search"}, EXPECTED | {"hidden"}), marks=pytest.mark.slow
        ),
    ],
)
def test_a_demonstration_comes_out(
    tmp_path: Path, scenario: str, gravity: str, states: set[str], expected: set[str]
) -> None:
    result = run_episode(load_scenario(scenario, [f"gravity={gravity}"]), tmp_path / "run", seed=0)
    assert result.succeeded, told(tmp_path / "run", result)
    check_result(tmp_path / "run", scenario, expected)
    check_ticks(tmp_path / "run", states)
    assert {p.name for p in (tmp_path / "run").iterdir()} == set(FILES)


def test_two_processes_with_one_seed_write_the_same_bytes(tmp_path: Path) -> None:
    """Cut at 20 s: unplugged, slipped, made room, and what a planner draws among it."""
    command = [sys.executable, "-c", "from regrasp.app.__main__ import main; main()", "run", "no_obstacle", "--quiet"]
    runs = [
        subprocess.Popen(
            [*command, "--set", "limits.sim_seconds=20", "--out", str(tmp_path / name)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
        )
        for name in ("one", "two")
    ]
    for run in runs:
        _, error = run.communicate(timeout=300)
        assert run.returncode == 1, error.decode()  # the time limit is not what the scenario expects
    for name in ("ticks.jsonl", "events.jsonl"):
        one, two = ((tmp_path / run / name).read_bytes() for run in ("one", "two"))
        assert one == two
        assert len(one.splitlines()) > 5
    assert any(own_name(line) == "make_room" for line in lines(tmp_path / "one/ticks.jsonl"))


def test_the_software_renderer_carries_the_run_as_far_as_the_slip(tmp_path: Path) -> None:
    scenario = load_scenario("no_obstacle", ["limits.sim_seconds=14"])
    result = run_episode(scenario, tmp_path / "run", seed=0, renderer="software")
    assert (result.outcome, result.renderer) == ("time_limit", "software")
    [slip] = result.measured["slips"]
    assert slip["detected_at"] is not None
    assert slip["detected_at"] - slip["released_at"] < 1.0


class WatchedWorld(World[Any]):
    """A world that a test can look at while `run_episode` has it."""

    made: "list[WatchedWorld]" = []  # noqa: RUF012

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.fastest_at_close = 0.0
        self.made.append(self)

    def fastest(self) -> float:
        """The fastest joint of both arms, rad/s."""
        return float(max(np.abs(arm.reading().velocities).max() for arm in self.arms.values()))

    def close(self) -> None:
        self.fastest_at_close = self.fastest()
        super().close()


LATE = ("make_room", "regrasp")  # as the other two, and it takes longer until they come


@pytest.mark.parametrize("state", ["unplug", "carry", *(pytest.param(s, marks=pytest.mark.slow) for s in LATE)])
def test_an_interrupt_in_the_middle_of_a_motion_leaves_the_arms_at_rest_0_3_s_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, state: str
) -> None:
    monkeypatch.setattr("regrasp.app.run.compose.World", WatchedWorld)
    stopped: list[float] = []

    def progress(now: float, leaf: str) -> None:
        if leaf == state and WatchedWorld.made[-1].fastest() > 0.3:
            stopped.append(now)
            raise KeyboardInterrupt

    result = run_episode(load_scenario("no_obstacle"), tmp_path / "run", seed=0, observers=Observers(tick=progress))
    assert result.outcome == "interrupted"
    [at] = stopped
    assert result.sim_seconds == pytest.approx(at + 0.3)
    assert WatchedWorld.made[-1].fastest_at_close < REST_SPEED
    ticks = lines(tmp_path / "run/ticks.jsonl")
    assert [line["status"] for line in ticks if own_name(line) == state] == ["RUNNING", "INVALID"]
    assert "RUNNING" not in {line["path"]: line["status"] for line in ticks}.values()
