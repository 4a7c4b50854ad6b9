import os
import re
import signal
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from toy_scenario import write_scenario
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.app.cli.options import parse_seeds
from regrasp.app.files.findings import Findings
from regrasp.app.files.resources import shipped
from regrasp.app.records.folders import new_folder
from regrasp.app.records.result import Result
from regrasp.app.run.batch import Settings
from regrasp.app.run.observers import Observers
from regrasp.app.task.expectation import Expectation
from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cause import Cause

Episode = Callable[..., Result]


def invoke(*args: str) -> Any:
    return CliRunner().invoke(app, args)


@pytest.fixture(autouse=True)
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    return write_scenario(tmp_path, monkeypatch)


def result(**changes: Any) -> Result:
    fields: dict[str, Any] = {
        "scenario": "mine",
        "seed": 7,
        "outcome": "success",
        "succeeded": True,
        "expectations": (Expectation("slips", True, 1, 1), Expectation("unintended_force", True, 1.23456, 5.0)),
        "task": "cable",
        "measured": {"slips": [{"released_at": 12.0, "detected_at": 12.25, "detected_by": "gap"}]},
        "sim_seconds": 80.0,
        "wall_seconds": 100.0,
        "real_time_factor": 0.8,
        "renderer": "moderngl",
    }
    return Result(**fields | changes)


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[SimpleNamespace]:
    """What `run_episode` was called with; it ticks five simulated seconds and succeeds."""
    made: list[SimpleNamespace] = []

    def episode(scenario: Any, out: Path, observers: Observers, **rest: Any) -> Result:
        made.append(SimpleNamespace(scenario=scenario, out=out, **rest))
        for tick in range(100):
            observers.tick(tick / 20, "carry" if tick < 60 else "look")
        return result()

    use_episode(monkeypatch, episode)
    return made


def use_episode(monkeypatch: pytest.MonkeyPatch, episode: Episode) -> None:
    module = SimpleNamespace(run_episode=episode)
    monkeypatch.setitem(__import__("sys").modules, "regrasp.app.run.episode", module)


def test_run_ends_with_a_summary_on_stdout_and_progress_on_stderr(calls: list[SimpleNamespace]) -> None:
    ran = invoke("run", "mine.yaml", "--seed", "7", "--video", "--set", "inputs.tries=2")
    assert ran.exit_code == 0
    assert ran.stdout.splitlines() == [
        "mine, seed 7: success, 2 of 2 expectations met",
        "  ✓ slips: 1 (expected: at least 1, all noticed)",
        "  ✓ unintended_force: 1.23 (expected: at most 5 N)",
        "  slip    lost at 12.00 s, noticed at 12.25 s by gap",
        "  record  runs/mine-7-1",
        "  time    80.0 s simulated in 100.0 s, real-time factor 0.80, renderer moderngl",
    ]
    assert ran.stderr.splitlines() == ["    0.0 s  carry", "    3.0 s  look"]
    (call,) = calls
    assert (call.out, call.seed, call.video, call.gui) == (Path("runs/mine-7-1"), 7, True, False)
    assert (call.renderer, Path("runs").exists()) == ("software", False)  # nothing was written: the folder is gone
    assert call.scenario.file.inputs == {"tries": 2}


def test_quiet_shows_the_summary_alone(calls: list[SimpleNamespace]) -> None:
    assert invoke("run", "mine.yaml", "--quiet").stderr == ""


def test_what_was_not_met_exits_1_with_the_cause(monkeypatch: pytest.MonkeyPatch) -> None:
    cause = Cause(CableCause.SEARCH_EXHAUSTED, "18 stops, nothing seen", "root/search")
    unmet = result(
        outcome="failure", succeeded=False, cause=cause, expectations=(Expectation("slips", False, 0, 1),), measured={}
    )
    use_episode(monkeypatch, lambda *_, **__: unmet)
    ran = invoke("run", "mine.yaml")
    assert ran.exit_code == 1
    assert "  cause   search_exhausted: 18 stops, nothing seen (root/search)" in ran.stdout
    assert "  ✗ slips: 0 (expected: at least 1, all noticed)" in ran.stdout


def test_ctrl_c_reaches_the_episode_between_two_ticks(monkeypatch: pytest.MonkeyPatch) -> None:
    ticks: list[str] = []

    def episode(*_: Any, observers: Observers, **__: Any) -> Result:
        try:
            for tick in range(9):
                ticks.append(f"{tick} begins")
                if tick == 3:
                    os.kill(os.getpid(), signal.SIGINT)
                ticks.append(f"{tick} ends")
                observers.tick(tick / 20, "carry")
        except KeyboardInterrupt:
            return result(outcome="interrupted", succeeded=False)
        raise AssertionError("not interrupted")

    use_episode(monkeypatch, episode)
    before = signal.getsignal(signal.SIGINT)
    ran = invoke("run", "mine.yaml")
    assert (ran.exit_code, ticks[-1]) == (130, "3 ends")
    assert "interrupted" in ran.stdout
    assert signal.getsignal(signal.SIGINT) is before


def test_bad_input_is_told_in_full_and_nothing_is_written(
    calls: list[SimpleNamespace], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "result.json").write_text("{}")
    before = sorted(tmp_path.rglob("*"))
    ran = invoke("run", "mine.yaml", "--set", "limits.tris=1", "--out", "taken", "--gui")
    assert (ran.exit_code, ran.stdout, calls) == (2, "", [])
    assert [line.split(": ")[0] for line in ran.stderr.splitlines()] == ["--gui", "--set limits.tris=1", "taken"]
    assert sorted(tmp_path.rglob("*")) == before


def test_options_of_one_case_and_of_all_do_not_mix(calls: list[SimpleNamespace], tmp_path: Path) -> None:
    ran = invoke("run", "mine.yaml", "--jobs", "2", "--junit", "a.xml", "--set", "gravity=mars")
    assert (ran.exit_code, calls) == (2, [])
    assert [line.split(": ")[0] for line in ran.stderr.splitlines()] == ["--jobs", "--junit", "--set gravity=mars"]
    ran = invoke("run", "mine.yaml", "--all", "--case", "default", "--set", "gravity=mars")
    assert ran.exit_code == 2
    assert ran.stderr.splitlines()[0] == "--case: is for a single case; leave --all out"
    assert ran.stderr.splitlines()[1].startswith("--set gravity=mars: gravity: no 'mars'")


def test_options_that_contradict_each_other_are_told(calls: list[SimpleNamespace], scenario: Path) -> None:
    scenario.write_text(scenario.read_text() + "vary: {gravity: [zero, earth]}\n")
    ran = invoke("run", "mine.yaml", "--case", "gravity=earth", "--set", "gravity=zero")
    assert ran.stderr == "--case: no case 'gravity=earth'; --set fixes what makes this case; leave one of them out\n"
    ran = invoke("run", "mine.yaml", "--seed", "1", "--set", "seed=2")
    assert ran.stderr == "--seed: the seed is given by --set, too; leave one out\n"
    assert (ran.exit_code, calls) == (2, [])


def test_a_folder_with_a_file_of_a_run_s_name_is_no_run(calls: list[SimpleNamespace], tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "cell.yaml").write_text("mine")
    told = invoke("run", "mine.yaml", "--out", "mine").stderr
    assert told == "mine: holds cell.yaml, which a run would overwrite; name another folder\n"


def test_a_case_is_run_by_its_name_with_its_own_seed(calls: list[SimpleNamespace], scenario: Path) -> None:
    scenario.write_text(scenario.read_text() + "vary: {seed: '4:9', gravity: [zero, earth]}\n")
    assert invoke("run", "mine.yaml", "--case", "seed=5,gravity=earth", "--quiet").exit_code == 0
    assert invoke("run", "mine.yaml", "--seed", "8", "--quiet").exit_code == 0
    assert [(c.seed, c.scenario.case, c.scenario.file.gravity) for c in calls] == [
        (5, "seed=5,gravity=earth", "earth"),
        (8, "seed=8,gravity=zero", "zero"),
    ]
    assert calls[0].out == Path("runs/mine-5-1")


@pytest.mark.parametrize(
    ("out", "expected"),
    [
        ("mine.yaml", "mine.yaml: 'mine.yaml' is no folder"),
        ("mine.yaml/run", "mine.yaml/run: 'mine.yaml' is no folder"),
        ("/proc/nowhere/run", "/proc/nowhere/run: cannot write in '/proc'"),
    ],
)
def test_an_output_folder_that_cannot_be_is_a_finding(calls: list[SimpleNamespace], out: str, expected: str) -> None:
    ran = invoke("run", "mine.yaml", "--out", out)
    assert (ran.exit_code, calls) == (2, [])
    assert ran.stderr.startswith(expected)


def test_each_run_gets_the_next_free_folder(tmp_path: Path) -> None:
    with ThreadPoolExecutor(8) as pool:  # all at once
        made = list(pool.map(new_folder, ["mine-3"] * 20))
    assert {str(folder) for folder in made} == {f"runs/mine-3-{n}" for n in range(1, 21)}
    assert all(folder.is_dir() for folder in made)


def test_a_scenario_s_odd_name_becomes_a_plain_folder(calls: list[SimpleNamespace], scenario: Path) -> None:
    scenario.rename(scenario.with_name("mine of [today]\n.yaml"))
    assert invoke("run", "mine of [today]\n.yaml", "--quiet").exit_code == 0
    [call] = calls
    assert re.fullmatch(r"runs/mine_of_today_-0-[0-9a-f]{8}-1", str(call.out))


def test_lists_name_what_is_shipped() -> None:
    assert invoke("trees", "list").stdout.split() == list(shipped("tree"))
    assert [line.split()[0] for line in invoke("scenarios", "list").stdout.splitlines()] == list(shipped("scenario"))


def test_trees_show_draws_a_file_and_tells_its_findings(tmp_path: Path) -> None:
    shown = invoke("trees", "show", "tree.xml")
    assert (shown.exit_code, "settle" in shown.stdout) == (0, True)
    (tmp_path / "tree.xml").write_text("<root")
    broken = invoke("trees", "show", "tree.xml")
    assert broken.exit_code == 2
    assert broken.stderr.startswith("tree.xml:1: ")


def test_trees_check_tells_every_finding_of_every_file(tmp_path: Path) -> None:
    clean = invoke("trees", "check", "tree.xml", "tree.xml")
    assert (clean.exit_code, clean.stdout, clean.stderr) == (0, "2 trees, no findings\n", "")
    text = (tmp_path / "tree.xml").read_text()
    (tmp_path / "late.xml").write_text(text.replace('seconds="0.1"', 'seconds="soon"').replace('name="settle" ', ""))
    (tmp_path / "cut.xml").write_text("<root")
    wrong = invoke("trees", "check", "late.xml", "nowhere", "tree.xml", "cut.xml")
    assert (wrong.exit_code, wrong.stdout) == (2, "")
    places = [line.split(": ")[0] for line in wrong.stderr.splitlines()]
    assert places == ["cut.xml:1", "late.xml:2", "late.xml:2", "nowhere"]


def test_trees_leaves_says_what_a_tree_may_hold() -> None:
    everything = invoke("trees", "leaves").stdout
    seconds = "    seconds        input, float above 0, required"
    for text in ("Wait", seconds, "Sequence           Ticks its", "SubTree"):
        assert text in everything
    one = invoke("trees", "leaves", "Retry").stdout.splitlines()
    assert one == [
        "Retry              Ticks its child anew after a failure.",
        "    returns        failure, running, success",
        "    num_failures   constant, int above 0, required: tries",
    ]
    unknown = invoke("trees", "leaves", "Wiat")
    assert (unknown.exit_code, unknown.stderr) == (2, "Wiat: no element 'Wiat'; did you mean 'Wait'?\n")


def test_study_demo_hands_on_seeds_jobs_and_overrides(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []

    def run_demo(*args: Any) -> int:
        asked.extend(args)
        return 130

    monkeypatch.setattr("regrasp.app.tasks.cable.studies.demo.run_demo", run_demo)
    ran = invoke("study", "demo", "--seeds", "2:5", "--jobs", "3", "--out", "study", "--set", "inputs.tries=1")
    assert ran.exit_code == 130
    assert asked == [range(2, 5), 3, Path("study"), ["inputs.tries=1"], Settings()]


@pytest.mark.parametrize("text", ["5", "5:", ":5", "5:5", "6:5", "a:b", "-1:3", "1:2:3", ""])
def test_a_wrong_range_of_seeds_is_a_finding(text: str) -> None:
    with pytest.raises(Findings, match="write A:B with A below B and B at most"):
        parse_seeds(text)


@pytest.mark.parametrize(
    "command",
    [
        [],
        ["run"],
        ["trees", "show"],
        ["trees", "check"],
        ["trees", "leaves"],
        ["scenarios", "list"],
        ["scenarios", "check"],
        ["scenarios", "show"],
        ["scenarios", "schema"],
        ["doctor"],
        ["study", "demo"],
        ["study", "pose"],
        ["explain"],
        ["replay"],
        ["diff"],
        ["perceive"],
        ["snapshot"],
        ["calibrate"],
        ["train-detector"],
        ["evaluate-detector"],
    ],
)
def test_help_is_plain_and_shows_how(command: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    ran = invoke(*command, "--help")
    assert ran.exit_code == 0
    assert "\x1b" not in ran.stdout
    assert max(map(len, ran.stdout.splitlines())) <= 80
    assert "regrasp" in ran.stdout or command in (["scenarios", "list"], ["doctor"])


@pytest.mark.parametrize("group", [[], ["scenarios"], ["trees"], ["study"]])
def test_in_80_columns_no_summary_is_cut(group: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    told = invoke(*group, "--help").stdout
    commands = told.partition("Commands:\n")[2].splitlines()
    assert commands
    assert "..." not in "".join(commands)
    assert group or commands[0].split()[0] == "run"


def test_the_shell_completes_names_of_scenarios(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("_REGRASP_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", "regrasp run short")
    monkeypatch.setenv("COMP_CWORD", "2")
    assert CliRunner().invoke(app, [], prog_name="regrasp").stdout.split() == ["short_obstacle"]


def test_a_dry_run_says_what_would_run_and_runs_nothing(calls: list[SimpleNamespace], scenario: Path) -> None:
    scenario.write_text(scenario.read_text() + "vary: {seed: '4:6'}\n")
    before = sorted(scenario.parent.rglob("*"))
    ran = invoke("run", "mine.yaml", "--dry-run")
    assert (ran.exit_code, calls) == (0, [])
    assert ran.stdout.splitlines() == [
        "mine.yaml: nothing wrong; tree tree.xml, cell thesis",
        "  would run mine seed=4, seed 4",
        "  record in a new folder of runs/",
    ]
    assert len(invoke("run", "mine.yaml", "--dry-run", "--all").stdout.splitlines()) == 4
    assert invoke("run", "mine.yaml", "--dry-run", "--set", "limits.tris=1").exit_code == 2
    assert invoke("run", "mine.yaml", "--dry-run", "--all", "--junit", ".").exit_code == 2
    assert sorted(scenario.parent.rglob("*")) == before


def test_events_are_shown_from_a_level_on(monkeypatch: pytest.MonkeyPatch) -> None:
    def episode(*_: Any, observers: Observers, **__: Any) -> Result:
        observers.event({"t": 1.0, "level": "info", "event": "grasped", "node": "root/unplug", "gap": 0.02})
        observers.event({"t": 2.0, "level": "warning", "event": "slipped"})
        return result()

    use_episode(monkeypatch, episode)
    assert invoke("run", "mine.yaml", "--quiet").stderr == ""
    warnings = invoke("run", "mine.yaml", "--quiet", "--log-level", "warning").stderr
    assert warnings == "   2.00 s  warning  -  slipped\n"
    assert invoke("run", "mine.yaml", "--log-level", "debug").stderr.splitlines()[0] == (
        "   1.00 s  info     root/unplug  grasped: gap=0.02"
    )


def test_version() -> None:
    assert invoke("--version").stdout.startswith("regrasp ")
