import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import stand_in_runs

import regrasp.behaviors  # noqa: F401 - once for good: pytester forgets what is imported in its runs, which ompl does not stand

SCENARIO = """\
description: a suite of two
cell: thesis
tree: recovery
gravity: zero
markers: [slow, on_the_floor]
vary: {gravity: [zero, earth]}
"""
CONFTEST = """\
import regrasp.app.pytest_plugin
import stand_in_runs
regrasp.app.pytest_plugin._run = stand_in_runs.{}
"""
TREE = '<root main_tree_to_execute="M"><BehaviorTree ID="M">{}</BehaviorTree></root>'
PLUGIN = ("-p", "regrasp.app.pytest_plugin", "-p", "no:cacheprovider")


@pytest.fixture
def suite(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> pytest.Pytester:
    """A folder with a scenario file, whose runs are stand-ins."""
    monkeypatch.setattr("regrasp.app.pytest_plugin._run", stand_in_runs.by_gravity)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(sys.path))
    (pytester.path / "cells.scenario.yaml").write_text(SCENARIO)
    return pytester


def run(suite: pytest.Pytester, *arguments: str) -> pytest.RunResult:
    return suite.runpytest_inprocess(*PLUGIN, *arguments)


def test_each_case_is_a_test_that_fails_with_the_explanation_alone(suite: pytest.Pytester) -> None:
    result = run(suite, "-v", "--strict-markers")
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(
        [
            "cells.scenario.yaml::gravity=zero PASSED*",
            "cells.scenario.yaml::gravity=earth FAILED*",
            "*_ cells.scenario.yaml: gravity=earth _*",
            "cells*, seed 0: failure, 0 of 1 expectations met*",
            "Why it ended so",
            "*search_exhausted: not seen from 18 stops",
            "record *cells-gravity=earth-0",
            "report *cells-gravity=earth-0/report.html",
        ]
    )
    result.stdout.no_fnmatch_line("*Traceback*")
    result.stdout.no_fnmatch_line("*pytest_plugin.py*")


def test_the_files_markers_choose_and_need_no_registration(suite: pytest.Pytester) -> None:
    run(suite, "-m", "not slow", "--strict-markers").assert_outcomes(deselected=2)
    run(suite, "-m", "on_the_floor", "-k", "zero", "--strict-markers").assert_outcomes(passed=1, deselected=1)


def test_a_seed_or_a_range_of_seeds_takes_the_place_of_the_files(suite: pytest.Pytester) -> None:
    (suite.path / "cells.scenario.yaml").write_text(SCENARIO + "seed: 13\n")  # at which the stand-in dies
    result = run(suite, "--scenario-seed", "3", "-k", "zero", "--junit-xml=report.xml")
    result.assert_outcomes(passed=1, deselected=1)
    assert 'name="seed" value="3"' in (suite.path / "report.xml").read_text()
    result = run(suite, "--scenario-seed", "2:4", "-k", "zero", "-v")
    result.assert_outcomes(passed=2, deselected=2)
    result.stdout.fnmatch_lines(["*::gravity=zero,seed=2 PASSED*", "*::gravity=zero,seed=3 PASSED*"])


@pytest.mark.parametrize("seed", ["x", "1:", "-1", "1:2:3", ""])
def test_no_seed_is_refused_at_once(suite: pytest.Pytester, seed: str) -> None:
    result = run(suite, f"--scenario-seed={seed}")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*is no seed; write a whole number, or a range such as 0:5"])


def test_each_case_has_a_process_and_a_record_folder_of_its_own(suite: pytest.Pytester) -> None:
    for _ in range(2):
        run(suite, "--scenario-records", "kept", "-k", "zero").assert_outcomes(passed=1, deselected=1)
    folders = sorted((suite.path / "kept").iterdir())
    assert [folder.name for folder in folders] == ["cells-gravity=zero-1", "cells-gravity=zero-2"]
    assert len({(folder / "pid").read_text() for folder in folders} | {str(os.getpid())}) == 3


def test_a_records_folder_that_cannot_be_is_refused_at_once(suite: pytest.Pytester) -> None:
    result = run(suite, "--scenario-records", "cells.scenario.yaml")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*is no folder; name another place"])


def test_a_process_that_dies_fails_its_test_only(suite: pytest.Pytester) -> None:
    result = run(suite, "--scenario-seed", "12:14", "-k", "zero")
    result.assert_outcomes(passed=1, failed=1, deselected=2)
    result.stdout.fnmatch_lines(["the process died with exit code 3", "*record*cells-gravity=zero,seed=13*"])


def test_findings_are_a_short_collection_error(suite: pytest.Pytester) -> None:
    (suite.path / "bad.scenario.yaml").write_text(
        SCENARIO.replace("cell: thesis", "cell: thesi").replace("slow", "s w")
    )
    result = run(suite, "--continue-on-collection-errors", "-k", "zero")
    result.assert_outcomes(passed=1, errors=1, deselected=1)
    result.stdout.fnmatch_lines(
        ["*bad.scenario.yaml:2: no cell named 'thesi'; did you mean 'thesis'?*", "*bad.scenario.yaml:5: *'s w'*"]
    )
    result.stdout.no_fnmatch_line("*Traceback*")


def test_cases_are_shared_out_between_two_workers(suite: pytest.Pytester) -> None:
    (suite.path / "conftest.py").write_text(CONFTEST.format("by_gravity"))
    result = suite.runpytest_subprocess(*PLUGIN, "-n", "2", "--scenario-records", "kept")
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(["*search_exhausted: not seen from 18 stops"])
    assert len(list((suite.path / "kept").iterdir())) == 2


def test_ctrl_c_lets_the_run_end_and_leaves_no_process(suite: pytest.Pytester) -> None:
    (suite.path / "conftest.py").write_text(CONFTEST.format("until_stopped"))
    arguments = [sys.executable, "-m", "pytest", *PLUGIN, "-k", "zero", "--scenario-records", "kept"]
    folder = suite.path / "kept" / "cells-gravity=zero-1"
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True, start_new_session=True) as process:
        while not (folder / "started").exists():
            assert process.poll() is None
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGINT)
        out, _ = process.communicate()
    assert process.returncode == pytest.ExitCode.INTERRUPTED
    assert "KeyboardInterrupt" in out
    assert (folder / "interrupted").exists()
    with pytest.raises(ProcessLookupError):
        os.kill(int((folder / "pid").read_text()), 0)


def test_a_tree_is_collected_by_name_by_place_or_because_it_is_asked_for(pytester: pytest.Pytester) -> None:
    places = ["sound.tree.xml", "trees/deep/a.xml", "my/b.xml", "my/deep/c.xml"]
    for place in places:
        (pytester.path / place).parent.mkdir(parents=True, exist_ok=True)
        (pytester.path / place).write_text(TREE.format('<StartUp name="start_up"/>'))
    result = run(pytester, "-v")
    result.assert_outcomes(passed=4)
    result.stdout.fnmatch_lines(["sound.tree.xml::ends PASSED*", "sound.tree.xml::stops at every tick PASSED*"])
    result.stdout.fnmatch_lines(["trees/deep/a.xml::ends PASSED*", "trees/deep/a.xml::stops at every tick PASSED*"])
    run(pytester, "trees", "sound.tree.xml").assert_outcomes(passed=4)
    run(pytester, "trees/deep").assert_outcomes(passed=2)
    run(pytester, "my").assert_outcomes(passed=2)
    run(pytester, "my/b.xml", "my/deep/c.xml").assert_outcomes(passed=4)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "<root",
        "\x00",
        "<?xml version='1.0' encoding='no-such'?><root/>",
        "<project/>",
        "<root><BehaviorTree ID='M'/></root>",
        "<root BTCPP_format='4' main_tree_to_execute='M'/>",
        "<!DOCTYPE a [<!ENTITY b 'b'>]><a main_tree_to_execute='M'>&b;</a>",
    ],
)
def test_other_xml_is_left_alone(pytester: pytest.Pytester, text: str) -> None:
    (pytester.mkdir("trees") / "other.xml").write_text(text)
    assert run(pytester, "trees").ret == pytest.ExitCode.NO_TESTS_COLLECTED


def test_a_tree_that_breaks_off_is_not_passed_over(pytester: pytest.Pytester) -> None:
    (pytester.mkdir("trees") / "cut.xml").write_text("<root main_tree_to_execute='M'><BehaviorTree")
    result = run(pytester)
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(["trees/cut.xml:1: malformed XML*"])


def test_a_tree_that_never_ends_fails_and_one_with_findings_is_a_short_collection_error(
    pytester: pytest.Pytester,
) -> None:
    (pytester.path / "endless.tree.xml").write_text(
        TREE.format('<SuccessIsRunning name="again"><StartUp name="start_up"/></SuccessIsRunning>')
    )
    (pytester.path / "typo.tree.xml").write_text(TREE.format('<StrtUp name="start_up"/>'))
    result = run(pytester, "--continue-on-collection-errors")
    result.assert_outcomes(passed=1, failed=1, errors=1)
    result.stdout.fnmatch_lines(
        ["*typo.tree.xml:1: unknown element 'StrtUp'*StartUp*", "what can succeed does: the tree still runs after*"]
    )
    result.stdout.no_fnmatch_line("*Traceback*")


def test_the_fixture_runs_a_shipped_tree_by_name(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        def test_logic(scripted_tree):
            tree = scripted_tree("recovery", {"StartUp": "2 failure", "SafeStop": "failure"})
            tree.run()
            assert tree.table("start_up", "safe_stop").splitlines()[1:] == ["start_up   RF", "safe_stop  .F"]
        """
    )
    run(pytester).assert_outcomes(passed=1)


def test_where_nothing_is_collected_nothing_of_ours_is_imported(tmp_path: Path) -> None:
    program = (
        "import json, sys, pytest; pytest.main(['-p', 'regrasp.app.pytest_plugin', '--co', '-q', sys.argv[1]]);"
        "print(json.dumps(sorted(m for m in sys.modules if m.split('.')[0] in sys.argv[2:])))"
    )
    packages = ["numpy", "pydantic", "py_trees", "pybullet", "typer"]
    done = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path), "regrasp", *packages], capture_output=True, text=True, check=True
    )
    assert json.loads(done.stdout.splitlines()[-1]) == ["regrasp", "regrasp.app", "regrasp.app.pytest_plugin"]


def test_help_says_what_a_suite_takes(pytester: pytest.Pytester) -> None:
    result = run(pytester, "--help")
    result.stdout.fnmatch_lines(["scenario suites*", "*--scenario-seed=N|A:B*", "*--scenario-records=DIR*"])
