import json
from pathlib import Path

import pytest
from toy_record import kill, write_record
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.app.records.explain import explanation
from regrasp.app.records.history import NodeHistory
from regrasp.app.records.reader import Event, read_record
from regrasp.app.records.result import Attempt, Link
from regrasp.app.records.timeline import timeline
from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cause import Cause, CauseCode
from regrasp.trees import executions


def page(folder: Path, width: int = 100) -> str:
    return explanation(read_record(folder), width)


def test_the_page_of_a_run_that_stopped_safely(tmp_path: Path) -> None:
    assert page(write_record(tmp_path / "run")).splitlines() == [
        "toy, seed 7: failure, 1 of 2 expectations met, 2.0 simulated seconds",
        *explain_head(),
        "",
        "Why it ended so",
        "  slipped: grasp 1 mm",
        "  in grasp",
        "  root               1.50 s  Fallback: all 3 children failed",
        "    mission          1.00 s  Sequence: child tries failed (2 of 2)",
        "      tries          1.00 s  Retry: 2 of 2 tries failed",
        "        one/try      1.00 s  Sequence: child grasp failed (2 of 2)",
        "          grasp      1.00 s  Script: slipped: grasp 1 mm",
        "",
        "What was tried (simulated seconds, from and to)",
        "                     root",
        "                       mission",
        "      0.00     0.00      start                            SUCCESS",
        "                         tries/one/try",
        "      0.00     0.00        held                           SUCCESS",
        "      0.00     0.50        grasp                          FAILURE",
        "                               0.50 s slip: by=gap, value=0.0443",
        "                               slipped: grasp 0 mm",
        "                         tries/one/try  again, round 2",
        "      1.00     1.00        held                           SUCCESS",
        "      1.00     1.00        grasp                          FAILURE",
        "                               slipped: grasp 1 mm",
        "      1.00     1.50    stop                               FAILURE",
        "      1.50     1.50    never                              FAILURE",
        "",
        "Losses of the connector, by ground truth",
        "  lost at 0.40 s, noticed at 0.50 s by gap",
        "",
        "What the robot knew at the end",
        "  the hand holds nothing",
        "  connector found by the wrist camera at (0.100, 0.200, 0.300) m, all of it seen",
        "  connector seen last at 1.25 s by the rear camera at (0.300, 0.100, 0.400) m",
        "  searches in vain since then: 2",
        "  obstacles mapped: 1902 voxels",
        "  left arm: tool at (0.100, 0.200, 0.300) m",
        "    joints (0.000, 0.000, 0.000, 0.000, 0.000, 0.000) rad",
        "  noticed a loss at 1.50 s by gap",
        "",
        "What was expected",
        "  ✗ outcome: failure (expected: success)",
        "  ✓ slips: 1 (expected: at least 1, all noticed)",
    ]


def explain_head() -> list[str]:
    from importlib.metadata import version

    return [f"  gravity zero, regrasp {version('regrasp')}", "  changed: limits.tries=2"]


@pytest.mark.parametrize("outcome", ["success", "time_limit", "interrupted", "internal_error"])
def test_every_outcome_has_its_page(tmp_path: Path, outcome: str) -> None:
    cause = None if outcome == "success" else Cause(CauseCode(outcome), "why", "root/mission")
    trace = "Traceback (most recent call last):\n  at home\n" if outcome == "internal_error" else None
    told = page(write_record(tmp_path / "run", outcome=outcome, cause=cause, chain=None, traceback=trace))
    assert told.startswith(f"toy, seed 7: {outcome}, ")
    assert ("Why it ended so" in told) == (outcome != "success")
    assert ("\nTraceback\n  Traceback (most recent call last):\n    at home\n" in told) == (trace is not None)


def test_a_killed_run_is_told_as_far_as_it_is_known(tmp_path: Path) -> None:
    kill(write_record(tmp_path / "run"))
    told = page(tmp_path / "run")
    assert told.startswith("toy, seed 7: killed, or still going on\n")
    assert (
        """\
What was tried (simulated seconds, from and to)
                     root/mission
      0.00     0.00    start                              SUCCESS
                       tries/one/try
      0.00     0.00      held                             SUCCESS
      0.00     0.50      grasp                            FAILURE
                             0.50 s slip: by=gap, value=0.0443
"""
        in told
    )
    assert "note: there is no result.json: the run was killed, or still goes on" in told
    assert "What was running at 0.50 s, when the record ends\n  root/mission/tries\n" in told
    assert "slip: by=gap, value=0.0443" in told


def test_a_run_that_was_killed_before_its_first_tick_has_a_page(tmp_path: Path) -> None:
    folder = write_record(tmp_path / "run")
    (folder / "result.json").unlink()
    (folder / "ticks.jsonl").write_text("")
    assert "killed, or still going on" in explanation(read_record(folder), 80)


@pytest.mark.parametrize("width", [80, 100, 120])
def test_long_sentences_are_wrapped(tmp_path: Path, width: int) -> None:
    cause = Cause(CableCause.SLIPPED, "the connector slipped away " * 20, "root")
    told = page(write_record(tmp_path / "run", cause=cause), width)
    assert " ".join(told.split()).count("slipped away") == 20
    assert max(map(len, told.splitlines())) <= width


def test_a_wrapped_link_of_the_chain_names_its_node_once(tmp_path: Path) -> None:
    chain = (Link("root", "Fallback", 1.0, "all failed"), Link("root/" + "long" * 12, "Grasp", 1.0, "gone " * 40))
    told = page(write_record(tmp_path / "run", chain=chain), 80)
    assert told.count("longlong") == 6  # once as a link
    assert told.count(" gone") + told.count("gone ") >= 40
    assert max(map(len, told.splitlines())) <= 80


def test_what_stands_in_a_record_does_not_steer_the_terminal(tmp_path: Path) -> None:
    cause = Cause(CableCause.SLIPPED, "\x1b[2J\x07gone", "root")
    told = page(write_record(tmp_path / "run", cause=cause, traceback="a\n\x1b[31mb"))
    assert "\\x1b[2J\\x07gone" in told
    assert "\x1b" not in told


def attempts(*lines: tuple[str, float, float, str]) -> list[Attempt]:
    return [Attempt(path, start, end, status) for path, start, end, status in lines]  # type: ignore[arg-type]


def ticks(*lines: tuple[float, str, str]) -> NodeHistory:
    return NodeHistory(executions(lines))


def test_rounds_that_went_alike_are_folded() -> None:
    again = [
        line
        for i in range(1, 6)
        for line in attempts(
            ("r/t/look", i, i, "SUCCESS"), ("r/t/grasp", i, i + 0.5, "FAILURE" if i < 5 else "SUCCESS")
        )
    ]
    tries = [(i + half, "r/t", "FAILURE" if half else "RUNNING") for i in range(1, 6) for half in (0.0, 0.5)]
    course = ticks((1.0, "r", "RUNNING"), *tries)
    assert [" ".join(line.split()) for line in timeline(again, [], course, 100)] == [
        "r/t",
        "1.00 1.00 look SUCCESS",
        "1.00 1.50 grasp FAILURE",
        "r/t again, round 2",
        "2.00 2.00 look SUCCESS",
        "2.00 2.50 grasp FAILURE",
        "3.00 4.50 and the same again, 2 more times",
        "r/t again, round 5",
        "5.00 5.00 look SUCCESS",
        "5.00 5.50 grasp SUCCESS",
    ]


def test_what_runs_side_by_side_or_is_asked_at_every_tick_is_no_new_round() -> None:
    both = attempts(("p/watch", 0.0, 1.0, "SUCCESS"), ("p/move", 0.0, 5.0, "SUCCESS"), ("p/watch", 2.0, 3.0, "SUCCESS"))
    assert not any("again" in line for line in timeline(both, [], ticks(), 100))
    asked = attempts(
        ("r/ok/held", 0.0, 0.0, "SUCCESS"), ("r/work", 0.0, 2.0, "INVALID"), ("r/ok/held", 1.0, 1.0, "FAILURE")
    )
    course = ticks((0.0, "r", "RUNNING"), *((t, "r/ok", "SUCCESS") for t in (0.0, 1.0)), (0.0, "r/work", "RUNNING"))
    assert not any("again" in line for line in timeline(asked, [], course, 100))


def test_a_loop_in_a_loop_counts_its_rounds_from_one() -> None:
    grasps = attempts(*(("o/in/try/grasp", float(t), float(t), "FAILURE") for t in range(4)))
    looks = attempts(*(("o/in/try/look", float(t), float(t), "SUCCESS") for t in range(4)))
    lines = [(0.0, "o", "RUNNING"), (0.0, "o/in", "RUNNING"), (0.0, "o/in/try", "FAILURE")]
    lines += [(1.0, "o/in", "FAILURE"), (1.0, "o/in/try", "FAILURE"), (2.0, "o/in", "RUNNING")]
    lines += [(2.0, "o/in/try", "FAILURE"), (3.0, "o/in", "FAILURE"), (3.0, "o/in/try", "FAILURE")]
    made = [one for pair in zip(looks, grasps, strict=True) for one in pair]
    told = [line.split("again, ")[1] for line in timeline(made, [], ticks(*lines), 100) if "again" in line]
    assert told == ["round 2", "round 2", "round 2"]


def test_many_events_of_an_attempt_are_counted() -> None:
    events = [Event(1.0, "look", "a/b", {"n": i}) for i in range(20)]
    told = [*timeline(attempts(("a/b", 0.0, 2.0, "SUCCESS")), events, ticks(), 100)]
    assert len(told) == 8
    assert told[-1].strip() == "and 14 more events"


def test_explain_prints_the_page_or_json(tmp_path: Path) -> None:
    folder = write_record(tmp_path / "run")
    told = CliRunner().invoke(app, ["explain", str(folder)])
    assert (told.exit_code, told.stdout) == (0, page(folder))
    value = json.loads(CliRunner().invoke(app, ["explain", str(folder), "--json"]).stdout)
    assert value["result"] == json.loads((folder / "result.json").read_text())
    assert value["run"]["overrides"] == ["limits.tries=2"]
    assert value["remarks"] == []
    kill(folder)
    killed = json.loads(CliRunner().invoke(app, ["explain", str(folder), "--json"]).stdout)
    assert killed["result"] is None
    assert [attempt["path"].rsplit("/", 1)[-1] for attempt in killed["attempts"]] == ["start", "held", "grasp"]
    bad = CliRunner().invoke(app, ["explain", str(tmp_path)])
    assert (bad.exit_code, bad.stdout) == (2, "")
    assert "holds no run" in bad.stderr


def test_a_killed_run_s_clock_goes_on_to_its_last_event(tmp_path: Path) -> None:
    folder = write_record(tmp_path / "run")
    kill(folder)
    with (folder / "events.jsonl").open("a") as events:
        events.write('{"t": 5.25, "level": "info", "event": "looks", "node": "root/mission"}\n')
    assert "What was running at 5.25 s, when the record ends\n  root/mission/tries\n" in page(folder)
    (folder / "at_work.json").write_text('{"t": 5.3, "node": "root/mission/tries/one/try/held"}')
    assert (
        "What was running at 5.30 s, when the record ends\n"
        "  root/mission/tries/one/try/held: its tick at 5.30 s has not ended\n"
    ) in page(folder)


@pytest.mark.parametrize("text", ["", "{", "[]", '{"t": "x", "node": "a"}', '{"t": 1, "node": ""}', '{"t": 1}', "\x00"])
def test_a_broken_note_of_the_leaf_at_work_says_nothing(tmp_path: Path, text: str) -> None:
    folder = write_record(tmp_path / "run")
    kill(folder)
    (folder / "at_work.json").write_text(text)
    assert "has not ended" not in page(folder)
