from pathlib import Path

import pytest
from fake_services import Stage
from py_trees.blackboard import Blackboard
from py_trees.common import Status

from regrasp.behaviors.keys import CAUSES
from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cause import Cause, CauseCode

STOP = '<SafeStop name="safe_stop"/>'


def test_it_stops_the_arms_at_once_and_fails_with_the_last_cause(known: CableKnown, tmp_path: Path) -> None:
    stage = Stage(known, tmp_path)
    slip = Cause(CableCause.SLIPPED, "an old slip", "root/a")
    reach = Cause(CauseCode.OUT_OF_REACH, "connector 0.82 m from the right arm", "root/b")
    Blackboard.set(CAUSES.path, (slip, reach))
    tree = stage.tree(STOP)
    assert stage.run(tree, 0.0) is Status.RUNNING
    assert stage.motion.stopped == 1
    assert stage.run(tree, 2.0) is Status.FAILURE
    assert stage.clock.t == pytest.approx(0.3, abs=0.051)
    assert stage.motion.stopped == 1
    assert [*stage.causes] == [slip, reach, reach]
    assert stage.causes[-1] is reach  # passed on, with the node that it came from
    assert stage.log.of("failed") == [
        {
            "node": "safe_stop",
            "code": "out_of_reach",
            "message": "connector 0.82 m from the right arm",
            "of": "root/b",
        }
    ]
    assert not stage.motion.grippers["right"].told  # the jaw keeps its force


def test_a_stop_without_a_cause_is_an_error_of_the_tree(known: CableKnown, tmp_path: Path) -> None:
    stage = Stage(known, tmp_path)
    assert stage.run(stage.tree(STOP), 2.0) is Status.FAILURE
    assert stage.causes[-1].code is CauseCode.INTERNAL_ERROR
