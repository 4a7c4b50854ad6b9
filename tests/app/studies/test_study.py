import json
import os
import re
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from regrasp.app.campaigns.statistics import wilson_interval
from regrasp.app.files.findings import Findings
from regrasp.app.records.result import Result
from regrasp.app.scenario.load import Scenario
from regrasp.app.task.expectation import Expectation
from regrasp.app.tasks.cable.studies.demo import run_demo
from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cause import Cause


def episode(scenario: Scenario, out: Path | None, *, seed: int, video: bool, renderer: str) -> Result:
    """Succeeds but for the tall obstacle's seed 1, and dies, raises there in other ways."""
    name, gravity = scenario.name, scenario.file.gravity
    if (name, gravity, seed) == ("no_obstacle", "earth", 0):
        raise ValueError("no such joint")
    if (name, gravity, seed) == ("short_obstacle", "zero", 1):
        os._exit(7)
    if out is not None:
        out.mkdir(parents=True)
        (out / "result.json").write_text(json.dumps(scenario.overrides))
    failed = name == "tall_obstacle" and seed == 1
    return Result(
        scenario=name,
        seed=seed,
        outcome="failure" if failed else "success",
        succeeded=not failed,
        cause=Cause(CableCause.SEARCH_EXHAUSTED, "18 stops") if failed else None,
        expectations=(
            Expectation("outcome", not failed, "success", "success"),
            Expectation("unintended_force", True, 1.0 + seed, 5.0),
        ),
        task="cable",
        measured={"slips": [{"released_at": 10.0, "detected_at": 10.5, "detected_by": "fingers"}]},
        sim_seconds=90.0 + seed,
        real_time_factor=2.0,
        wall_by_part={"physics": 9.0 + seed, "step loop": 3.0 + seed, "start": 1.8},
        longest_tick=0.25,
    )


def test_a_study_goes_on_to_its_end_and_counts_every_run(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert run_demo(range(2), 2, tmp_path, ["inputs.tries=2"], episode=episode) == 0
    demo = json.loads((tmp_path / "demo.json").read_text())
    assert (demo["runs"], demo["succeeded"], demo["seeds"]) == (12, 8, [0, 1])
    rows = {(r["scenario"], r["gravity"], r["seed"]): r for r in demo["rows"]}
    assert list(rows) == [
        (s, g, i) for s in ("no_obstacle", "short_obstacle", "tall_obstacle") for g in ("zero", "earth") for i in (0, 1)
    ]
    good = rows["tall_obstacle", "earth", 0]
    assert good["succeeded"]
    assert [slip["detected_by"] for slip in good["measured"]["slips"]] == ["fingers"]
    assert (good["unintended_force"], good["unmet"]) == (1.0, [])
    assert good["peak_memory_mb"] > 5
    bad = rows["tall_obstacle", "zero", 1]
    assert (bad["outcome"], bad["unmet"], bad["cause"]["code"]) == ("failure", ["outcome"], "search_exhausted")
    assert rows["no_obstacle", "earth", 0]["cause"]["message"] == "ValueError: no such joint"
    assert rows["short_obstacle", "zero", 1]["cause"]["message"] == "the process died with exit code 7"
    kept = json.loads((tmp_path / "runs" / "tall_obstacle-gravity=earth-0" / "result.json").read_text())
    assert kept == ["inputs.tries=2"]

    out, err = capfd.readouterr()
    lines = [re.split(r"\s{2,}", line.strip()) for line in out.splitlines()]
    assert lines[0][:4] == ["case", "succeeded", "95 % interval", "median sim s"]
    assert lines[0][4:] == ["median x real time", "max force N", "longest tick s", "max memory MB"]
    assert lines[1][:6] == ["no_obstacle gravity=zero", "2/2", "34.2 to 100.0 %", "90.5", "2.00", "2.00"]
    assert lines[1][6] == "0.25"
    assert lines[7][:3] == ["all", "8/12", "39.1 to 86.2 %"]
    parts = {line[0]: line[1:] for line in lines[9:]}
    assert list(parts) == ["part", "start", "physics", "step loop", "whole run"]
    assert parts["physics"] == ["105", "1.00", "1.00"]  # 100 with seed 0, 110 with seed 1
    assert parts["step loop"][1] == "0.37"
    assert len(err.splitlines()) == 12
    assert "[12/12]" in err


def test_a_folder_that_holds_something_else_is_refused(tmp_path: Path) -> None:
    (tmp_path / "demo.json").write_text("{}")
    with pytest.raises(Findings, match=r"holds other things \(demo.json\)"):
        run_demo(range(1), 1, tmp_path, episode=episode)


def slow_after_two(scenario: Scenario, out: Path | None, *, seed: int, video: bool, renderer: str) -> Result:
    """The third run waits for a signal that only the study can bring."""
    if seed == 2:
        assert out is not None
        try:
            print("waiting", flush=True)
            signal.pause()
        except KeyboardInterrupt:
            (out.parents[2] / "interrupted").touch()
            raise
    return Result(scenario.name, seed, "success", succeeded=True)


def test_ctrl_c_keeps_what_was_done_and_stops_what_runs(tmp_path: Path) -> None:
    program = textwrap.dedent("""
        import sys
        from pathlib import Path
        from regrasp.app.tasks.cable.studies.demo import run_demo
        from test_study import slow_after_two
        if __name__ == "__main__":
            sys.exit(run_demo(range(3), 1, Path(sys.argv[1]), episode=slow_after_two))
    """)
    (tmp_path / "program.py").write_text(program)
    arguments = [sys.executable, str(tmp_path / "program.py"), str(tmp_path / "study")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, env=environment, start_new_session=True) as process:
        assert process.stdout is not None
        process.stdout.readline()
        os.killpg(process.pid, signal.SIGINT)
        assert process.wait() == 130
    demo = json.loads((tmp_path / "study" / "demo.json").read_text())
    assert (demo["runs"], demo["succeeded"], demo["planned"]) == (2, 2, 18)
    assert (tmp_path / "interrupted").exists()


@pytest.mark.parametrize(
    ("k", "n", "low", "high"),
    [
        (0, 10, 0.0, 0.2775),  # Newcombe 1998, Statistics in Medicine 17, table I and its formula
        (10, 10, 0.7225, 1.0),
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (1, 29, 0.0061, 0.1718),
        (0, 0, 0.0, 1.0),
    ],
)
def test_wilson_interval(k: int, n: int, low: float, high: float) -> None:
    assert wilson_interval(k, n) == pytest.approx((low, high), abs=5e-5)


def test_a_share_lies_in_its_interval() -> None:
    for n in range(1, 200):
        for k in (0, n // 2, n):
            low, high = wilson_interval(k, n)
            assert low <= k / n <= high
