import io
import json

import py_trees
from py_trees.common import ParallelPolicy, Status

from regrasp.app.run.tick_log import TickLog, active_leaf


class Script(py_trees.behaviour.Behaviour):  # type: ignore[misc]
    """Returns one status a tick, as written; the last one for ever."""

    def __init__(self, name: str, *statuses: Status) -> None:
        super().__init__(name)
        self.statuses = list(statuses)

    def update(self) -> Status:
        return self.statuses.pop(0) if len(self.statuses) > 1 else self.statuses[0]


R, S, F = Status.RUNNING, Status.SUCCESS, Status.FAILURE


def guarded_tree() -> py_trees.behaviour.Behaviour:
    """A guard that fails at the third tick takes the work away from a Parallel of monitor and move."""
    work = py_trees.composites.Parallel(
        "work", ParallelPolicy.SuccessOnOne(), [Script("monitor", R), Script("move", R, R, S)]
    )
    guarded = py_trees.composites.Sequence("guarded", memory=False, children=[Script("guard", S, S, F), work])
    return py_trees.composites.Selector("root", memory=False, children=[guarded, Script("stop", R, S)])


def log_of(root: py_trees.behaviour.Behaviour, ticks: int) -> list[tuple[float, str, str]]:
    clock = [0.0]
    stream = io.StringIO()
    log = TickLog(root, stream, lambda: clock[0])
    tree = py_trees.trees.BehaviourTree(root)
    tree.add_visitor(log)
    for _ in range(ticks):
        tree.tick()
        clock[0] += 0.05
    root.stop(Status.INVALID)
    log.finalise()
    lines = [json.loads(line) for line in stream.getvalue().splitlines()]
    return [(line["t"], line["path"].removeprefix("root/"), line["status"]) for line in lines]


def test_changes_repeated_ends_and_stops_are_logged_in_tree_order() -> None:
    # tick   | guard   | work    | monitor | move    | stop
    # 0.00   | SUCCESS | RUNNING | RUNNING | RUNNING | -
    # 0.05   | SUCCESS, again | no change
    # 0.10   | FAILURE | INVALID | INVALID | INVALID | RUNNING: the work is preempted and never visited
    # 0.15   | no change but stop SUCCESS, root SUCCESS; then the tree is stopped
    assert log_of(guarded_tree(), 3) == [
        (0.0, "root", "RUNNING"),
        (0.0, "guarded", "RUNNING"),
        (0.0, "guarded/guard", "SUCCESS"),
        (0.0, "guarded/work", "RUNNING"),
        (0.0, "guarded/work/monitor", "RUNNING"),
        (0.0, "guarded/work/move", "RUNNING"),
        (0.05, "guarded/guard", "SUCCESS"),
        (0.1, "guarded", "FAILURE"),
        (0.1, "guarded/guard", "FAILURE"),
        (0.1, "guarded/work", "INVALID"),
        (0.1, "guarded/work/monitor", "INVALID"),
        (0.1, "guarded/work/move", "INVALID"),
        (0.1, "stop", "RUNNING"),
        (0.15, "root", "INVALID"),
        (0.15, "guarded", "INVALID"),
        (0.15, "guarded/guard", "INVALID"),
        (0.15, "stop", "INVALID"),
    ]


def test_a_node_started_and_stopped_within_one_tick_shows_both() -> None:
    children = [Script("monitor", R), Script("slip", F)]
    root = py_trees.composites.Parallel("root", ParallelPolicy.SuccessOnAll(), children)
    assert [entry for entry in log_of(root, 1) if entry[1] == "monitor"] == [
        (0.0, "monitor", "RUNNING"),
        (0.0, "monitor", "INVALID"),
    ]


def test_the_log_is_the_same_byte_for_byte_although_ids_differ() -> None:
    assert log_of(guarded_tree(), 5) == log_of(guarded_tree(), 5)


def test_an_exception_in_a_leaf_still_leaves_its_tick_in_the_log() -> None:
    class Broken(Script):
        def update(self) -> Status:
            raise RuntimeError("broken")

    root = py_trees.composites.Sequence("root", memory=True, children=[Script("first", S), Broken("second", R)])
    stream = io.StringIO()
    log = TickLog(root, stream, lambda: 1.0)
    tree = py_trees.trees.BehaviourTree(root)
    tree.add_visitor(log)
    try:
        tree.tick()
    except RuntimeError:
        root.stop(Status.INVALID)
        log.finalise()
    assert '{"t": 1.0, "path": "root/first", "status": "SUCCESS"}\n' in stream.getvalue()


def test_the_active_leaf_is_the_work_beside_a_monitor() -> None:
    root = guarded_tree()
    assert active_leaf(root) == ""
    root.tick_once()
    assert active_leaf(root) == "move"
    root.tick_once()
    root.tick_once()
    assert active_leaf(root) == "stop"
