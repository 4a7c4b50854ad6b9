from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fake_services import Stage, seen, unseen
from py_trees.common import Status
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cause import CauseCode
from regrasp.motion.failure import PlanningError
from regrasp.perception.pose.estimate import Estimate

REPLUG = '<Replug name="replug" socket="back_4"/>'
LOOK = '<LookAtPlug name="look" socket="back_4"/>'
HELD = RigidTransform.from_components([0.0, 0.0, 0.01], Rotation.from_euler("z", 90, degrees=True))


@pytest.fixture
def stage(known: CableKnown, tmp_path: Path) -> Stage:
    return Stage(known, tmp_path)


def lying(stamp: float, connector: RigidTransform) -> Estimate:
    position, axis = connector.translation, connector.rotation.apply([1.0, 0.0, 0.0])
    return replace(seen(stamp, position), axis=axis, world_from_connector=connector)


def test_it_tells_at_which_try_the_plug_went_in(stage: Stage) -> None:
    stage.belief.held = HELD
    stage.perception.shows = lambda _, t: unseen(t)
    assert stage.run(stage.tree(REPLUG), 60.0) is Status.SUCCESS
    assert [name for name, _ in stage.motion.plugged] == ["back_4"]
    [told] = stage.log.of("plugged in")
    assert (told["tries"], told["across"], told["strongest"]) == (2, [0.0025, 0.0043], 9.9)
    assert stage.belief.held is not None  # the jaw is still closed


@pytest.mark.parametrize(("turn_deg", "believed_deg"), [(4.0, 90.0), (15.0, 105.0)])
def test_sight_corrects_the_tip_and_only_a_great_turn(stage: Stage, turn_deg: float, believed_deg: float) -> None:
    stage.belief.held = HELD
    turned = Rotation.from_euler("z", 90 + turn_deg, degrees=True)
    really = RigidTransform.from_components([0.002, 0.004, 0.01], turned)
    stage.perception.shows = lambda _, t: lying(t, stage.motion.tool_pose * really)
    assert stage.run(stage.tree(REPLUG), 60.0) is Status.SUCCESS
    [(_, held)] = stage.motion.plugged
    tip = [0.5 * stage.known.cable.connector.length, 0.0, 0.0]
    assert held.apply(tip) == pytest.approx(really.apply(tip), abs=1e-3)
    assert held.rotation.as_euler("zyx", degrees=True)[0] == pytest.approx(believed_deg, abs=0.5)


def test_a_plug_that_goes_in_nowhere_fails_with_its_cause(stage: Stage) -> None:
    stage.belief.held = HELD
    stage.perception.shows = lambda _, t: unseen(t)
    stage.motion.error = PlanningError(CableCause.NOT_PLUGGED, "nowhere within 9 mm")
    assert stage.run(stage.tree(REPLUG), 60.0) is Status.FAILURE
    assert [(cause.code, cause.message) for cause in stage.causes] == [("not_plugged", "nowhere within 9 mm")]


def test_what_was_lost_on_the_way_is_not_plugged_in(stage: Stage) -> None:
    stage.belief.held = HELD
    stage.perception.shows = lambda _, t: unseen(t)
    tree = stage.tree(REPLUG)
    stage.run(tree, 0.3)
    stage.belief.held = None
    assert stage.run(tree, 10.0) is Status.FAILURE
    assert [cause.code for cause in stage.causes] == [CableCause.SLIPPED]
    assert not stage.motion.plugged


def test_a_socket_that_the_cable_does_not_reach_fails_before_anything_moves(stage: Stage) -> None:
    tree = '<CheckSocket name="check" socket="back_3"/>'
    stage.motion.error = PlanningError(CableCause.CABLE_TOO_SHORT, "does not reach")
    assert stage.run(stage.tree(tree), 1.0) is Status.FAILURE
    assert [cause.code for cause in stage.causes] == [CableCause.CABLE_TOO_SHORT]
    stage.motion.error = None
    assert stage.run(stage.tree(tree), 1.0) is Status.SUCCESS


def test_a_carry_that_is_blocked_fails_with_its_cause(stage: Stage) -> None:
    stage.belief.held = HELD
    tree = stage.tree('<CarryToSocket name="carry" socket="back_4"/>')
    stage.motion.error = PlanningError(CauseCode.OUT_OF_REACH, "no free hand pose")
    assert stage.run(tree, 5.0) is Status.FAILURE
    assert [cause.code for cause in stage.causes] == [CauseCode.OUT_OF_REACH]


def test_letting_go_of_the_plug_believes_nothing_held(stage: Stage) -> None:
    stage.belief.held = HELD
    stage.motion.grippers["right"].gap = 0.05
    assert stage.run(stage.tree('<LetGoOfPlug name="let_go" socket="back_4"/>'), 5.0) is Status.SUCCESS
    assert stage.motion.grippers["right"].told[0][0] == "open"
    assert stage.belief.held is None


@pytest.mark.parametrize(("off", "there"), [([0.0, 0.02, 0.01], True), ([0.0, 0.0, -0.10], False)])
def test_it_is_seen_whether_the_connector_stays_in_its_socket(stage: Stage, off: list[float], there: bool) -> None:
    plug = stage.known.cable.socket("back_4").world_from_plug(stage.known.cable.connector.length)
    stage.perception.shows = lambda _, t: seen(t, np.add(plug.translation, off))
    assert (stage.run(stage.tree(LOOK), 3.0) is Status.SUCCESS) == there
    assert [cause.code for cause in stage.causes] == ([] if there else [CableCause.NOT_PLUGGED])
    assert [notice.by for notice in stage.belief.notices] == ([] if there else ["place"])
