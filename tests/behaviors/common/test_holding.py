from pathlib import Path

from fake_services import Stage
from py_trees.common import Status
from scipy.spatial.transform import RigidTransform

from regrasp.behaviors.cable.keys import LossNotice
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cause import Cause, CauseCode


def test_an_empty_hand_says_how_often_and_when_it_lost_what_it_held(known: CableKnown, tmp_path: Path) -> None:
    stage = Stage(known, tmp_path)
    tree = stage.tree('<Holding name="holding"/>')
    assert stage.run(tree, 0.0) is Status.FAILURE
    stage.belief.notices = (LossNotice(3.0, "distance"), LossNotice(9.3, "gap"))
    assert stage.run(tree, 0.0) is Status.FAILURE
    assert [*stage.causes] == [
        Cause(CauseCode.NOTHING_HELD, "the hand holds nothing; no loss was noticed", "holding"),
        Cause(CauseCode.NOTHING_HELD, "the hand holds nothing; 2 losses noticed, the last at 9.30 s by gap", "holding"),
    ]
    stage.belief.held = RigidTransform.identity()
    assert stage.run(tree, 0.0) is Status.SUCCESS
