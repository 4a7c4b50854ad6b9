"""What leaves do when a service breaks off or a camera is not to be trusted."""

from pathlib import Path

import numpy as np
import pytest
from fake_services import Stage, seen
from py_trees.common import Status

from regrasp.behaviors.cable.recover import WaitUntilStill, WaitUntilStillParameters
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cause import CauseCode, ServiceError
from regrasp.interfaces.frame import Intrinsics, RgbdFrame
from regrasp.motion.execution import GripParameters

LEAF = '<{} name="leaf"/>'
K = Intrinsics(4, 4, 4.0, 4.0, 1.5, 1.5)
REAR, WRIST = "the rear camera is dark", "the wrist camera is frozen"


@pytest.fixture
def stage(known: CableKnown, tmp_path: Path) -> Stage:
    return Stage(known, tmp_path)


@pytest.mark.parametrize("leaf", ["Monitor", "CheckCameras", "LookAtStow", "MakeRoom", "WaitUntilStill"])
def test_a_service_that_breaks_off_stops_the_arms_and_fails_the_leaf(
    stage: Stage, monkeypatch: pytest.MonkeyPatch, leaf: str
) -> None:
    def breaks(camera: str) -> None:
        raise ServiceError("perception.look broke off")

    monkeypatch.setattr(stage.perception, "look", breaks)
    assert stage.run(stage.tree(LEAF.format(leaf)), 3.0) is Status.FAILURE
    [cause] = stage.causes
    assert (cause.code, cause.message) == (CauseCode.SERVICE_FAILED, "perception.look broke off")
    assert stage.motion.stopped == 1


def test_a_mistake_in_a_leaf_is_not_taken_for_a_service(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stage.perception, "look", lambda camera: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        stage.run(stage.tree(LEAF.format("CheckCameras")), 3.0)


def test_without_the_rear_camera_it_waits_as_long_as_a_cable_swings(stage: Stage) -> None:
    stage.perception.troubles["rear"] = REAR
    assert stage.run(stage.tree(LEAF.format("WaitUntilStill")), 20.0) is Status.SUCCESS
    assert stage.clock.t == pytest.approx(WaitUntilStillParameters().blind_time, abs=0.11)


def test_a_leaf_takes_other_parameters(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(WaitUntilStill, "parameters", WaitUntilStillParameters(blind_time=1.0))
    stage.perception.troubles["rear"] = REAR
    assert stage.run(stage.tree(LEAF.format("WaitUntilStill")), 20.0) is Status.SUCCESS
    assert stage.clock.t == pytest.approx(1.0, abs=0.11)


@pytest.mark.parametrize("leaf", ["WaitUntilStill", "LookAtStow"])
def test_without_any_camera_the_cause_is_the_cameras(stage: Stage, leaf: str) -> None:
    stage.perception.troubles |= {"rear": REAR, "wrist": WRIST}
    assert stage.run(stage.tree(LEAF.format(leaf)), 5.0) is Status.FAILURE
    [cause] = stage.causes
    assert cause.code is CauseCode.CAMERA_FAILED
    assert REAR in cause.message


def test_without_the_wrist_camera_there_is_no_search(stage: Stage) -> None:
    stage.perception.troubles["wrist"] = WRIST
    assert stage.run(stage.tree(LEAF.format("SpiralSearch")), 5.0) is Status.FAILURE
    assert stage.causes[-1].code is CauseCode.CAMERA_FAILED
    assert [arm for arm, _ in stage.motion.moves] == ["left"]  # back to sleep


def test_a_start_without_the_rear_camera_is_no_start(stage: Stage) -> None:
    stage.perception.troubles["rear"] = REAR
    assert stage.run(stage.tree(LEAF.format("StartUp")), 5.0) is Status.FAILURE
    assert stage.causes[-1].code is CauseCode.CAMERA_FAILED
    assert stage.clock.t == pytest.approx(2.0, abs=0.11)


def test_a_start_waits_for_every_fixed_camera(stage: Stage) -> None:
    stage.perception.fixed_cameras = ("rear", "side")
    still = RgbdFrame("rear", 1, 0.0, np.zeros((4, 4, 3), np.uint8), np.zeros((4, 4), np.float32), K)
    stage.perception.frames = lambda t: still
    stage.perception.troubles["side"] = "the side camera is dark"
    tree = stage.tree(LEAF.format("StartUp"))
    assert stage.run(tree, 1.0) is Status.RUNNING
    assert stage.perception.looks == []
    stage.perception.troubles.clear()
    assert stage.run(tree, 1.0) is Status.SUCCESS
    assert len(stage.perception.looks) == 1
    stage.perception.troubles["side"] = "the side camera is dark"
    assert stage.run(tree, 5.0) is Status.FAILURE
    assert stage.causes[-1].message == "the side camera is dark; nothing was mapped"


def test_the_clip_is_looked_at_with_the_wrist_camera_when_the_rear_one_is_dark(stage: Stage) -> None:
    stage.perception.troubles["rear"] = REAR
    seat = np.array(stage.known.cable.clip.seat)
    stage.perception.shows = lambda camera, t: seen(t, seat, camera) if camera == "wrist" else None
    assert stage.run(stage.tree(LEAF.format("LookAtStow")), 5.0) is Status.SUCCESS
    assert [arm for arm, _ in stage.motion.moves] == ["left", "left"]  # there and back


def test_the_monitor_says_once_that_a_camera_is_not_trusted_and_once_that_it_is_again(stage: Stage) -> None:
    watch = '<Sequence name="w" memory="false"><Monitor name="m"/><DetectSlip name="d"/></Sequence>'
    tree = stage.tree(watch)
    for trouble in (None, REAR, REAR, None, None):
        stage.perception.troubles = {"rear": trouble} if trouble else {}
        for _ in range(3):
            tree.tick()
            stage.clock.t += 0.05
    assert [line["trusted"] for line in stage.log.of("camera")] == [False, True]


def test_a_jaw_that_does_not_close_is_told_three_times(stage: Stage) -> None:
    """The fake jaw reads 50 mm whatever it is told."""
    stage.motion.grippers["right"].gap = 0.05
    assert stage.run(stage.tree('<Unplug name="unplug" socket="back_4"/>'), 9.0) is Status.FAILURE
    assert stage.causes[-1].code is CauseCode.GRIPPER_FAILED
    assert [what for what, _ in stage.motion.grippers["right"].told] == ["close"] * 3
    assert stage.clock.t > 3 * GripParameters().time
