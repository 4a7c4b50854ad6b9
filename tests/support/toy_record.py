"""A record that the real logs wrote of a small tree: two tries to grasp, then the safe stop. 0.5 s a tick."""

from pathlib import Path
from typing import Any

import py_trees
from py_trees.common import Status
from py_trees.composites import Selector, Sequence
from py_trees.decorators import Retry
from scripted import F, R, S, Script

from regrasp.app.records.record import Record
from regrasp.app.records.result import Result
from regrasp.app.run.attempts import Attempts
from regrasp.app.run.tick_log import TickLog
from regrasp.app.task.expectation import Expectation
from regrasp.interfaces.cause import Cause

TREE = """\
<root main_tree_to_execute="Main">
  <BehaviorTree ID="Main">
    <Fallback name="root" memory="true">
      <Sequence name="mission" memory="true">
        <Look name="start"/>
        <Retry name="tries" num_failures="2"><SubTree ID="Try" name="one"/></Retry>
      </Sequence>
      <Stop name="stop"/>
      <Stop name="never"/>
    </Fallback>
  </BehaviorTree>
  <BehaviorTree ID="Try">
    <Sequence name="try" memory="true"><Look name="held"/><Grasp name="grasp"/></Sequence>
  </BehaviorTree>
</root>
"""
POSE = {"position": [0.1, 0.2, 0.3], "quaternion": [0.0, 0.0, 0.0, 1.0]}
BELIEF = {
    "held": None,
    "connector": POSE,
    "sure": True,
    "found_by": "wrist",
    "last_seen": {"at": 1.25, "camera": "rear", "position": [0.3, 0.1, 0.4]},
    "arms": {"left": {"joints": [0.0] * 6, "tool": POSE}},
    "occupied_voxels": 1902,
    "vain_searches": 2,
    "notices": [[1.5, "gap"]],
}


def write_record(folder: Path, seed: int = 7, gap: float = 0.0443, **changes: Any) -> Path:
    """Write the record into `folder`; `changes` are fields of the result, None for `outcome` leaves it out."""
    causes: list[Cause] = []
    body = Sequence("one.try", memory=True, children=[Script("held", S), Script("grasp", R, F, F, causes=causes)])
    mission = Sequence("mission", memory=True, children=[Script("start", S), Retry("tries", body, 2)])
    stop = [Script("stop", R, F), Script("never", F)]
    tree = py_trees.trees.BehaviourTree(Selector("root", memory=True, children=[mission, *stop]))
    clock = [0.0]
    record = Record(folder, "toy", seed, copies={"tree.xml": TREE})
    attempts = Attempts(tree.root, lambda: causes, lambda: clock[0], {"root": "Fallback"})
    tree.visitors += [TickLog(tree.root, record.ticks, lambda: clock[0]), attempts]
    log = record.logger(lambda: clock[0])
    log.info("begin", scenario="toy", seed=seed, gravity="zero", overrides=["limits.tries=2"])
    while tree.root.status is not Status.FAILURE:
        tree.tick()
        if clock[0] == 0.5:
            log.info("slip", node="root/mission/tries/one/try/grasp", by="gap", value=gap)
        clock[0] += 0.5
    fields: dict[str, Any] = {
        "outcome": "failure",
        "succeeded": False,
        "cause": attempts.cause(),
        "chain": attempts.failed_chain(),
        "expectations": (Expectation("outcome", False, "failure", "success"), Expectation("slips", True, 1, 1)),
        "task": "cable",
        "measured": {"slips": [{"released_at": 0.4, "detected_at": 0.5, "detected_by": "gap"}]},
        "sim_seconds": clock[0],
        "belief": BELIEF,
        "attempts": tuple(attempts.made),
    }
    with record:
        record.finish(Result("toy", seed, **fields | changes))
    return folder


def kill(folder: Path) -> None:
    """Make of it what a run leaves that is killed while it writes the tick of second 1."""
    (folder / "result.json").unlink()
    data = (folder / "ticks.jsonl").read_bytes()
    (folder / "ticks.jsonl").write_bytes(data[: data.index(b'"t": 1.0') + 6])
