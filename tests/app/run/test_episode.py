import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import own_leaves
import py_trees
import pytest
from py_trees.common import Status

from regrasp.app.files.findings import Findings
from regrasp.app.records.explain import explanation
from regrasp.app.records.reader import read_record
from regrasp.app.records.result import Result
from regrasp.app.records.summary import run_summary
from regrasp.app.run.episode import run_episode
from regrasp.app.run.observers import Observers
from regrasp.app.scenario.load import Scenario, load_scenario
from regrasp.behaviors.leaf import Leaf, LeafFailed, LeafSteps, StepsLeaf
from regrasp.interfaces.cause import CauseCode
from regrasp.sim.world import World


class Swing(StepsLeaf):
    """Swings both arms out of their sleep pose, then waits for ever."""

    def steps(self) -> LeafSteps:
        motion = self.services.motion
        tasks = [motion.move(arm, motion.joints(arm)[None] + [turn, 0.4, -0.2, 0, 0, 0]) for arm, turn in SWINGS]
        while True:
            for task in tasks:
                task.poll()
            yield None


class Breaks(StepsLeaf):
    """Raises after `AFTER` seconds."""

    AFTER: ClassVar[float] = 0.8

    def steps(self) -> LeafSteps:
        yield from self.wait(self.AFTER)
        raise ZeroDivisionError("no joint that long")


class BreaksAtOnce(Leaf):
    """Raises in the method that `WHERE` names."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {}
    OUTPUT_PORTS: ClassVar[dict[str, Any]] = {}
    WHERE: ClassVar[str] = "update"

    def _may_raise(self, where: str) -> None:
        if where == self.WHERE:
            raise ZeroDivisionError(f"no joint that long in {where}")

    def setup(self, **kwargs: Any) -> None:
        super().setup(**kwargs)
        self._may_raise("setup")

    def initialise(self) -> None:
        self._may_raise("initialise")

    def update(self) -> Status:
        self._may_raise("update")
        return Status.RUNNING

    def terminate(self, new_status: Status) -> None:
        self._may_raise("terminate")


class GivesUp(StepsLeaf):
    """Fails with a cause after half a second."""

    def steps(self) -> LeafSteps:
        yield from self.wait(0.5)
        raise LeafFailed(CauseCode.OUT_OF_REACH, "connector 0.82 m from the right arm, reach 0.75 m")


class Done(StepsLeaf):
    """Succeeds after half a second."""

    def steps(self) -> LeafSteps:
        yield from self.wait(0.5)


SWINGS = (("left", 0.4), ("right", -0.4))
LEAVES = {leaf.__name__: leaf for leaf in (Swing, Breaks, BreaksAtOnce, GivesUp, Done)}
BOTH = '<Parallel name="both" policy="success_on_one"><Swing name="swing"/>{}</Parallel>'


@pytest.fixture(autouse=True)
def ends(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[tuple[bool, float]]]:
    """Of each world at its end: whether an arm is told to move, and the fastest joint (rad/s)."""
    found: list[tuple[bool, float]] = []
    close = World.close

    def watched(world: World[Any]) -> None:
        speeds = [np.abs(arm.reading().velocities).max() for arm in world.arms.values()]
        found.append((any(arm.is_moving() for arm in world.arms.values()), float(max(speeds))))
        close(world)

    monkeypatch.setattr(World, "close", watched)
    own_leaves.put_in(LEAVES, monkeypatch.setattr)
    yield found
    py_trees.blackboard.Blackboard.clear()


def scenario(folder: Path, body: str, *overrides: str) -> Scenario:
    (folder / "tree.xml").write_text(
        f'<root main_tree_to_execute="Main"><BehaviorTree ID="Main">{body}</BehaviorTree></root>'
    )
    (folder / "mine.yaml").write_text(
        f"description: a toy\ncell: thesis\ntree: {folder / 'tree.xml'}\ngravity: zero\n"
        "limits: {sim_seconds: 1.0}\nexpect: {outcome: failure}\n"
    )
    return load_scenario(str(folder / "mine.yaml"), overrides)


def records(folder: Path, name: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / name).read_text().splitlines()]


def check_record(folder: Path, result: Result) -> dict[str, Any]:
    """The record is whole and says what the result says."""
    read: dict[str, Any] = json.loads((folder / "result.json").read_text())
    assert read["outcome"] == result.outcome
    assert read["succeeded"] == result.succeeded
    events = records(folder, "events.jsonl")
    assert (events[0]["event"], events[-1]["event"]) == ("begin", "end")
    assert events[-1]["outcome"] == result.outcome
    ticks = records(folder, "ticks.jsonl")
    assert ticks[0]["t"] == 0.0
    final = {line["path"]: line["status"] for line in ticks}
    assert "RUNNING" not in final.values()  # every node was brought to an end
    return read


def at_rest(ends: list[tuple[bool, float]]) -> bool:
    [(moving, speed)] = ends
    return not moving and speed < 0.02


def test_the_time_limit_ends_a_run_with_the_arms_at_rest(tmp_path: Path, ends: list[tuple[bool, float]]) -> None:
    result = run_episode(scenario(tmp_path, '<Swing name="swing"/>'), tmp_path / "run", seed=0)
    read = check_record(tmp_path / "run", result)
    assert result.outcome == "time_limit"
    assert read["cause"]["code"] == "time_limit"
    assert "1 simulated second" in read["cause"]["message"]
    assert result.sim_seconds == pytest.approx(1.3, abs=0.06)  # the limit, and the braking
    assert at_rest(ends)


def test_the_time_limit_names_the_node_that_it_cut_short(tmp_path: Path) -> None:
    result = run_episode(scenario(tmp_path, '<Swing name="swing"/>'), None, seed=0)
    assert result.cause is not None
    assert result.cause.node.endswith("swing")


def test_an_error_in_a_leaf_is_told_with_its_node_and_traceback(tmp_path: Path, ends: list[tuple[bool, float]]) -> None:
    made = scenario(tmp_path, BOTH.format('<Breaks name="breaks"/>'))
    result = run_episode(made, tmp_path / "run", seed=0)
    read = check_record(tmp_path / "run", result)
    assert result.outcome == "internal_error"
    assert not result.succeeded
    assert read["cause"]["code"] == "internal_error"
    assert read["cause"]["message"] == "ZeroDivisionError: no joint that long"
    assert read["cause"]["node"].endswith("both/breaks")
    [told] = [e for e in records(tmp_path / "run", "events.jsonl") if e["event"] == "exception in a tick"]
    assert told["node"] == read["cause"]["node"]
    assert "Traceback" in told["exception"]
    assert "in steps" in told["exception"]
    assert told["t"] == pytest.approx(0.8, abs=0.06)
    assert at_rest(ends)


@pytest.mark.parametrize("where", ["setup", "initialise", "update", "terminate"])
def test_wherever_a_leaf_raises_the_arms_rest_and_the_record_says_so(
    tmp_path: Path, ends: list[tuple[bool, float]], monkeypatch: pytest.MonkeyPatch, where: str
) -> None:
    monkeypatch.setattr(BreaksAtOnce, "WHERE", where)
    made = scenario(tmp_path, BOTH.format('<BreaksAtOnce name="breaks"/>'), "limits.sim_seconds=0.5")
    result = run_episode(made, tmp_path / "run", seed=0)
    read = json.loads((tmp_path / "run/result.json").read_text())
    assert (result.outcome, read["cause"]["node"]) == ("internal_error", "both/breaks")
    assert f"in {where}" in read["traceback"]
    assert [(link["path"], link["type"]) for link in read["chain"]] == [
        ("both", "Parallel"),
        ("both/breaks", "BreaksAtOnce"),
    ]
    assert read["chain"][1]["why"] == f"raised ZeroDivisionError: no joint that long in {where}"
    assert read["attempts"][-1]["path"] == "both/breaks"
    assert read["attempts"][-1]["cause"]["code"] == "internal_error"
    assert "RUNNING" not in {line["path"]: line["status"] for line in records(tmp_path / "run", "ticks.jsonl")}.values()
    assert at_rest(ends)


def test_a_judge_that_raises_leaves_a_whole_record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(self: object) -> dict[str, object]:
        raise ZeroDivisionError("no slips")

    monkeypatch.setattr("regrasp.app.tasks.cable.judge.CableJudge.measured", broken)
    run_episode(scenario(tmp_path, '<GivesUp name="reach"/>', "limits.sim_seconds=0.8"), tmp_path / "run", seed=4)
    result = read_record(tmp_path / "run").result
    assert result is not None
    assert (result.task, result.outcome, result.succeeded) == ("cable", "internal_error", False)
    assert result.cause is not None
    assert result.cause.message == "the judge of the task cable raised ZeroDivisionError: no slips"
    assert [attempt.path for attempt in result.attempts] == ["reach"]


def test_the_record_holds_what_it_takes_to_run_the_same_again(tmp_path: Path) -> None:
    body, change = '<GivesUp name="reach"/>', "cell.hidden.errors.arm_tool=0.0"
    made = scenario(tmp_path, body, "limits.sim_seconds=0.8", change, "gravity=earth")
    run_episode(made, tmp_path / "run", seed=4)
    again = load_scenario(str(tmp_path / "run/scenario.yaml"))
    assert again.cell == made.cell
    named = {"task": "cable", "cell": "cell.yaml", "tree": "tree.xml", "seed": 4}
    assert again.file == made.file.model_copy(update=named)
    run_episode(again, tmp_path / "again", seed=4)
    assert (tmp_path / "again/ticks.jsonl").read_bytes() == (tmp_path / "run/ticks.jsonl").read_bytes()


DRAW = (
    "draw={obstacles: [{name: foam, count: [1, 2], size: {x: [0.05, 0.05], y: [0.05, 0.05], z: [0.05, 0.1]}, "
    "region: {x: [0.3, 0.4], y: [-0.2, 0.2]}}]}"
)


def test_the_record_of_a_drawn_scene_shows_it_and_runs_it_again(tmp_path: Path) -> None:
    short = scenario(tmp_path, '<GivesUp name="reach"/>', "limits.sim_seconds=0.3", DRAW)
    result = run_episode(short, tmp_path / "run", seed=701)
    begin = records(tmp_path / "run", "events.jsonl")[0]
    assert result.thrown_away is not None
    assert begin["thrown_away"] == result.thrown_away
    assert set(result.thrown_away) == {"scenes", "blocks"}
    again = load_scenario(str(tmp_path / "run/scenario.yaml"))
    assert again.file.draw is None
    assert again.file.obstacles
    assert "thrown away" in run_summary(result, tmp_path)
    other = run_episode(again, tmp_path / "again", seed=701)
    assert other.thrown_away is None
    for name in ("ticks.jsonl", "signals.f32", "scenario.yaml", "cell.yaml"):
        assert (tmp_path / "again" / name).read_bytes() == (tmp_path / "run" / name).read_bytes()


def test_a_scene_that_cannot_be_drawn_leaves_no_record(tmp_path: Path) -> None:
    in_the_panel = DRAW.replace("[0.3, 0.4]", "[0.51, 0.51]")[:-1] + ", tries: 1}"
    with pytest.raises(Findings, match="no room for its blocks"):
        run_episode(scenario(tmp_path, '<GivesUp name="reach"/>', in_the_panel), tmp_path / "run", seed=1)
    assert not (tmp_path / "run").exists()


def test_ctrl_c_between_two_ticks_leaves_a_whole_record(tmp_path: Path, ends: list[tuple[bool, float]]) -> None:
    shown = []

    def progress(now: float, leaf: str) -> None:
        shown.append((now, leaf))
        if now > 0.7:
            raise KeyboardInterrupt

    made = scenario(tmp_path, '<Swing name="swing"/>')
    result = run_episode(made, tmp_path / "run", seed=0, observers=Observers(tick=progress))
    read = check_record(tmp_path / "run", result)
    assert (result.outcome, read["cause"]["code"]) == ("interrupted", "interrupted")
    assert read["cause"]["node"].endswith("swing")
    assert [leaf for _, leaf in shown] == ["swing"] * len(shown)
    assert np.diff([now for now, _ in shown]) == pytest.approx(0.05)
    assert at_rest(ends)


def test_a_failed_tree_ends_in_a_safe_stop_with_the_cause_of_its_leaf(tmp_path: Path) -> None:
    result = run_episode(scenario(tmp_path, '<GivesUp name="reach"/>'), tmp_path / "run", seed=0)
    read = check_record(tmp_path / "run", result)
    assert (result.outcome, result.succeeded) == ("failure", True)  # as this scenario expects
    assert read["cause"]["code"] == "out_of_reach"
    assert "0.82 m" in read["cause"]["message"]
    assert read["cause"]["node"].endswith("reach")


def test_what_a_fallback_caught_is_in_the_record_of_a_run(tmp_path: Path) -> None:
    body = '<Fallback name="either" memory="true"><GivesUp name="reach"/><Done name="done"/></Fallback>'
    run_episode(scenario(tmp_path, body, "limits.sim_seconds=2.0"), tmp_path / "run", seed=0)
    record = read_record(tmp_path / "run")
    assert record.result is not None
    assert record.result.belief is not None
    assert [(a.path, a.status, a.cause and a.cause.code) for a in record.result.attempts] == [
        ("either/reach", "FAILURE", CauseCode.OUT_OF_REACH),
        ("either/done", "SUCCESS", None),
    ]
    page = " ".join(explanation(record, 80).split())
    assert "out_of_reach: connector 0.82 m from the right arm, reach 0.75 m" in page
    assert "the hand holds nothing" in page


def test_a_tree_that_says_success_is_not_believed(tmp_path: Path) -> None:
    made = scenario(tmp_path, '<Done name="done"/>', "expect.outcome=success")
    result = run_episode(made, None, seed=0)
    assert result.outcome == "success"
    assert not result.succeeded
    outcome, end = result.expectations
    assert (outcome.met, end.met, end.value, end.limit) == (True, False, "plugged", "stowed")


def test_a_tree_alone_may_end_with_the_connector_plugged(tmp_path: Path) -> None:
    result = run_episode(scenario(tmp_path, '<Done name="done"/>', "expect={end: plugged}"), None, seed=0)
    assert result.succeeded


def test_a_film_does_not_change_the_run(tmp_path: Path) -> None:
    for name, video in (("with", True), ("without", False)):
        run_episode(scenario(tmp_path, '<Swing name="swing"/>'), tmp_path / name, seed=3, video=video)
    assert (tmp_path / "with/ticks.jsonl").read_bytes() == (tmp_path / "without/ticks.jsonl").read_bytes()
    assert (tmp_path / "with/video.mp4").stat().st_size > 1000
    assert not (tmp_path / "without/video.mp4").exists()


def test_a_film_that_cannot_be_drawn_is_an_internal_error_with_a_whole_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> Any:
        raise ZeroDivisionError("no film")

    monkeypatch.setattr("regrasp.app.run.film.make_renderer", broken)
    result = run_episode(scenario(tmp_path, '<Done name="done"/>'), tmp_path / "run", seed=0, video=True)
    assert result.outcome == "internal_error"
    assert result.cause is not None
    assert result.cause.message == "ZeroDivisionError: no film"
    assert result.expectations
    assert result.sim_seconds >= 0.3


def test_a_folder_that_holds_a_run_is_refused_before_anything_moves(
    tmp_path: Path, ends: list[tuple[bool, float]]
) -> None:
    (tmp_path / "result.json").write_text("mine")
    with pytest.raises(Findings, match="holds a run already"):
        run_episode(scenario(tmp_path, '<Done name="done"/>'), tmp_path, seed=0)
    assert ends == []
    assert (tmp_path / "result.json").read_text() == "mine"
