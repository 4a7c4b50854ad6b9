"""What the ticks tell against what a watcher of the same tree saw."""

import io
import json
import random
import tempfile
from pathlib import Path

import py_trees
from hypothesis import given, settings
from py_trees.behaviours import Failure, Running, Success
from py_trees.common import Status
from py_trees.ports import NoDataAvailable
from random_trees import LEAVES, Dice, trees

from regrasp.app.records.history import attempts_from_ticks
from regrasp.app.run.attempts import Attempts
from regrasp.app.run.tick_log import TickLog
from regrasp.trees import NodeExecution, TreeError, executions, load_tree, run_stats

TICK = 0.05


def ticked(root: py_trees.behaviour.Behaviour, ticks: int) -> tuple[Attempts, list[tuple[float, str, str]]]:
    """What the watcher saw, and the lines of the log."""
    clock = [0.0]
    stream = io.StringIO()
    log, attempts = TickLog(root, stream, lambda: clock[0]), Attempts(root, tuple, lambda: clock[0])
    tree = py_trees.trees.BehaviourTree(root)
    tree.visitors += [log, attempts]
    for _ in range(ticks):
        tree.tick()
        if root.status is not Status.RUNNING:
            break
        clock[0] += TICK
    root.stop(Status.INVALID)
    log.finalise()
    attempts.finalise()
    lines = [json.loads(line) for line in stream.getvalue().splitlines()]
    return attempts, [(line["t"], line["path"], line["status"]) for line in lines]


@settings(max_examples=40, deadline=None)
@given(text=trees())
def test_the_ticks_of_any_tree_tell_its_attempts_and_one_count_of_visits(text: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "tree.xml"
        path.write_text(text)
        try:
            root = load_tree(path, LEAVES)
        except TreeError:
            return
    Dice.dice = random.Random(text)
    try:
        attempts, lines = ticked(root, 30)
    except (LookupError, NoDataAvailable):  # a key that was never written
        return
    told = attempts_from_ticks(executions(lines), [])
    leaves = {attempt.path for attempt in told}
    assert told == attempts.made
    visits = {path: stats.visits for path, stats in run_stats(lines).items() if path in leaves}
    assert visits == {path: sum(a.times for a in told if a.path == path) for path in leaves}


def test_each_round_of_a_loop_is_an_attempt_and_a_guard_s_ticks_are_one() -> None:
    # tick  | held    | grasp   |       round of the loop
    # 0.00  | SUCCESS | FAILURE | 1
    # 0.05  | SUCCESS | FAILURE | 2
    # 0.10  | SUCCESS | FAILURE | 3
    body = py_trees.composites.Sequence("try", memory=True, children=[Success("held"), Failure("grasp")])
    attempts, lines = ticked(py_trees.decorators.Retry("root", body, 3), 9)
    assert [(a.path, a.times) for a in attempts.made] == [("root/try/held", 1), ("root/try/grasp", 1)] * 3
    assert attempts_from_ticks(executions(lines), []) == attempts.made
    assert run_stats(lines)["root/try"].text == "3 visits, 3 failed"

    guarded = py_trees.composites.Sequence("root", memory=False, children=[Success("guard"), Running("move")])
    attempts, lines = ticked(guarded, 3)
    assert [(a.path, a.times) for a in attempts.made] == [("root/guard", 3), ("root/move", 1)]
    assert attempts_from_ticks(executions(lines), []) == attempts.made


def test_what_runs_when_the_log_ends_has_run_until_its_last_line() -> None:
    lines = [(0.0, "a", "RUNNING"), (0.0, "a/b", "RUNNING"), (2.0, "a/c", "SUCCESS")]
    assert executions(lines) == [
        NodeExecution("a", 0.0, 2.0, "RUNNING"),
        NodeExecution("a/b", 0.0, 2.0, "RUNNING"),
        NodeExecution("a/c", 2.0, 2.0, "SUCCESS"),
    ]
