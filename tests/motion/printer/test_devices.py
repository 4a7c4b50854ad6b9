"""The four devices in the habitat's world: goal, feedback, result, cancelling, preemption, causes."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import pybullet as p
import pytest
import structlog
from scipy.spatial.transform import RigidTransform

from regrasp.app.scenario.load import load_scenario
from regrasp.app.tasks.printer.services import printer_services
from regrasp.behaviors.printer.services import PrinterServices
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.printer.actions import (
    Action,
    GripperGoal,
    ImageGoal,
    JointGoal,
    PoseGoal,
    PoseRelGoal,
    RailGoal,
)
from regrasp.interfaces.printer.cause import PrinterCause
from regrasp.interfaces.printer.cell import PrinterCell
from regrasp.interfaces.request import RequestError
from regrasp.motion.printer.service import TO_THE_PRINTER, PrinterMotion
from regrasp.perception.printer.detector import PartDetector
from regrasp.sim.printer.objects import PrinterObjects
from regrasp.sim.world import World

TICK = 0.05


@dataclass
class Rig:
    world: World[PrinterObjects]
    services: PrinterServices

    def wait(self, seconds: float, *actions: Action[Any, Any]) -> None:
        for _ in range(round(seconds / TICK)):
            for action in actions:
                action.poll()
            self.world.advance(TICK)

    def run(self, action: Action[Any, Any], seconds: float = 30.0) -> Any:
        end = self.world.now() + seconds
        while not action.poll():
            assert self.world.now() < end, "the action does not end"
            self.world.advance(TICK)
        return action.answer

    def joints(self) -> Any:
        return self.services.motion.joints("arm").copy()


@pytest.fixture
def rig() -> Iterator[Rig]:
    cell = load_scenario("printer_door").cell
    assert isinstance(cell, PrinterCell)
    world = World(cell, "zero", 3, PrinterObjects(cell))
    yield Rig(world, printer_services(world, 3, structlog.get_logger()))
    world.close()


def pose(x: float, y: float, z: float) -> RigidTransform:
    return RigidTransform.from_components([x, y, z], TO_THE_PRINTER)


def test_the_manipulator_goes_to_a_pose_by_an_offset_and_to_joints(rig: Rig) -> None:
    manipulator = rig.services.manipulator
    before = rig.joints()
    result = rig.run(manipulator.send(PoseGoal(pose(-0.15, 2.2, 1.5), standoff=0.05)))
    np.testing.assert_allclose(result.tool.translation, [-0.15, 2.2, 1.5], atol=3e-3)
    result = rig.run(manipulator.send(PoseRelGoal((0.03, -0.05, 0.02))))
    np.testing.assert_allclose(result.tool.translation, [-0.12, 2.15, 1.52], atol=5e-3)
    result = rig.run(manipulator.send(JointGoal(tuple(before[1:]))))
    np.testing.assert_allclose(result.joints[1:], before[1:], atol=5e-3)


def test_a_pose_out_of_the_arms_reach_moves_the_rail_as_a_seventh_joint(rig: Rig) -> None:
    before = rig.joints()
    result = rig.run(rig.services.manipulator.send(PoseGoal(pose(-0.25, 1.2, 1.5))))
    np.testing.assert_allclose(result.tool.translation, [-0.25, 1.2, 1.5], atol=3e-3)
    assert abs(result.joints[0] - before[0]) > 0.2


def test_the_rail_tells_where_it_is_and_arrives(rig: Rig) -> None:
    action = rig.services.rail.send(RailGoal(1.2))
    told = []
    while not action.poll():
        told.append(action.feedback().position)
        rig.world.advance(TICK)
    assert all(np.diff(told) < 2e-3)
    assert told[0] > 1.7
    assert action.answer.position == pytest.approx(1.2, abs=2e-3)


def test_a_cancelled_arm_stops_at_once_and_takes_the_next_goal(rig: Rig) -> None:
    action = rig.services.rail.send(RailGoal(0.3))
    rig.wait(1.5, action)
    action.cancel()
    rig.wait(0.6)  # the time of a halt
    stood = rig.joints()
    rig.wait(1.0, action)
    np.testing.assert_allclose(rig.joints(), stood, atol=1e-3)
    assert 0.5 < stood[0] < 1.7
    assert action.cancelled
    assert action.poll()
    assert rig.run(rig.services.rail.send(RailGoal(1.7))).position == pytest.approx(1.7, abs=2e-3)


def test_a_new_goal_preempts_the_one_under_way_of_arm_or_rail(rig: Rig) -> None:
    first = rig.services.rail.send(RailGoal(0.3))
    rig.wait(1.0, first)
    second = rig.services.manipulator.send(PoseGoal(pose(-0.2, 2.0, 1.5)))
    assert first.cancelled
    with pytest.raises(RequestError, match="another goal was sent") as raised:
        first.poll()
    assert raised.value.code is PrinterCause.PREEMPTED
    result = rig.run(second)
    np.testing.assert_allclose(result.tool.translation, [-0.2, 2.0, 1.5], atol=3e-3)
    assert not rig.world.contact_peaks


def test_the_gripper_goes_to_a_gap_and_presses_with_a_force(rig: Rig) -> None:
    gripper = rig.services.gripper
    for gap in (0.06, 0.03):
        assert rig.run(gripper.send(GripperGoal(gap))).gap == pytest.approx(gap, abs=3e-3)
    for force, code in ((20.0, CauseCode.GRASP_EMPTY), (1000.0, CauseCode.OUT_OF_REACH)):
        with pytest.raises(RequestError) as raised:
            rig.run(gripper.send(GripperGoal(force=force)))  # nothing is between the pads
        assert raised.value.code is code


def test_gripper_and_arm_move_at_once(rig: Rig) -> None:
    rail, gripper = rig.services.rail.send(RailGoal(1.5)), rig.services.gripper.send(GripperGoal(0.07))
    rig.wait(2.5, rail, gripper)
    assert gripper.answer.gap == pytest.approx(0.07, abs=3e-3)
    assert rail.answer.position == pytest.approx(1.5, abs=2e-3)


def test_the_analyzer_finds_what_the_camera_shows(rig: Rig) -> None:
    """From 0.25 m before the section and level with it: the camera looks from 6 cm above."""
    printer = rig.services.known.printer
    with pytest.raises(RequestError, match="did not show targ") as raised:
        rig.run(rig.services.analyzer.send(ImageGoal("targ", seconds=0.3)))  # behind the closed door
    assert raised.value.code is PrinterCause.TARGET_NOT_SEEN
    p.resetJointState(rig.world.objects.door.body, 0, printer.door.travel, physicsClientId=rig.world.client)
    x, y, z = printer.part.section.center
    assert isinstance(rig.services.motion, PrinterMotion)
    rig.services.motion.believe_door(printer.door.travel)
    rig.run(rig.services.manipulator.send(PoseGoal(pose(x + 0.25, y, z))))
    section = rig.run(rig.services.analyzer.send(ImageGoal("targ")))
    part = rig.run(rig.services.analyzer.send(ImageGoal("obj")))
    assert abs(section.offset[0]) < 15.0  # px; the camera is off by 2 mm and 0.3 degrees
    assert section.offset[1] > 40.0
    assert part.area > 3.0 * section.area
    assert part.box[0] < section.box[0] < section.box[2] < part.box[2]  # px: the section stands before the part
    assert part.confidence is not None
    assert part.confidence > 0.5
    near = section.area
    rig.run(rig.services.manipulator.send(PoseRelGoal((-0.05, 0.0, 0.0))))
    assert rig.run(rig.services.analyzer.send(ImageGoal("targ"))).area > 1.15 * near


def test_a_target_that_the_network_does_not_see_is_found_by_its_colour(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    door = rig.services.known.printer.door
    p.resetJointState(rig.world.objects.door.body, 0, door.travel, physicsClientId=rig.world.client)
    assert isinstance(rig.services.motion, PrinterMotion)
    rig.services.motion.believe_door(door.travel)
    x, y, z = rig.services.known.printer.part.section.center
    rig.run(rig.services.manipulator.send(PoseGoal(pose(x + 0.25, y, z))))
    by_network = rig.run(rig.services.analyzer.send(ImageGoal("obj")))
    monkeypatch.setattr(PartDetector, "detect", lambda *_: [])
    by_color = rig.run(rig.services.analyzer.send(ImageGoal("obj")))
    assert by_color.confidence is None
    np.testing.assert_allclose(by_color.box, by_network.box, atol=3.0)  # px; the camera's noise


@pytest.mark.parametrize(
    ("goal", "code", "why"),
    [
        (PoseGoal(pose(1.9, 2.2, 1.0)), CauseCode.OUT_OF_REACH, "no joint angles bring the tool of the arm there"),
        (PoseGoal(pose(-0.6, 2.25, 1.6)), CauseCode.NO_COLLISION_FREE_GOAL, "printer_left"),
        (PoseRelGoal((-0.6, 0.0, 0.0)), CauseCode.MOTION_BLOCKED, "straight on"),
        (JointGoal((9.0, 0.0, 0.0, 0.0, 0.0, 0.0)), CauseCode.OUT_OF_REACH, "limits"),
    ],
)
def test_a_goal_that_cannot_be_reached_ends_with_its_cause(rig: Rig, goal: Any, code: str, why: str) -> None:
    before = rig.joints()
    with pytest.raises(RequestError, match=why) as raised:
        rig.run(rig.services.manipulator.send(goal))
    assert raised.value.code is code
    np.testing.assert_allclose(rig.joints(), before, atol=1e-3)


def test_gaps_and_places_that_the_devices_have_not(rig: Rig) -> None:
    with pytest.raises(RequestError, match="the jaw opens from 0 to 85 mm, asked for 200 mm"):
        rig.run(rig.services.gripper.send(GripperGoal(0.2)))
    with pytest.raises(RequestError, match=r"the rail goes from 0 to 3\.2 m"):
        rig.run(rig.services.rail.send(RailGoal(3.3)))


@pytest.mark.parametrize("device", ["manipulator", "rail", "gripper", "analyzer"])
def test_another_devices_goal_is_one_clear_error(rig: Rig, device: str) -> None:
    goal: Any = RailGoal(1.0) if device != "rail" else GripperGoal(0.01)
    with pytest.raises(TypeError, match=rf"the .*{device} takes .*, not {type(goal).__name__}"):
        getattr(rig.services, device).send(goal)
    with pytest.raises(TypeError, match="not str"):
        getattr(rig.services, device).send("fly")


def test_a_thing_that_is_not_there_cannot_be_touched(rig: Rig) -> None:
    with pytest.raises(ValueError, match="no thing 'door_handel'; did you mean 'door_handle'"):
        rig.services.manipulator.send(PoseGoal(pose(-0.2, 2.2, 1.5), 0.05, ("door_handel",)))


NAN = float("nan")


@pytest.mark.parametrize(
    ("make", "why"),
    [
        (lambda: PoseGoal(RigidTransform.from_translation([NAN, 2.0, 1.5])), "the pose"),
        (lambda: PoseGoal(pose(0.0, 2.0, 1.5), standoff=-0.1), "the standoff is -0.1"),
        (lambda: PoseRelGoal((0.0, NAN, 0.0)), "the offset"),
        (lambda: PoseRelGoal(cast(Any, (0.0, 0.0))), "the offset has the shape"),
        (lambda: JointGoal((NAN,) * 6), "the angles"),
        (lambda: GripperGoal(NAN), "the gap is nan"),
        (lambda: GripperGoal(0.02, force=-3.0), "the force is -3"),
        (lambda: RailGoal(float("inf")), "the rail's position"),
        (lambda: ImageGoal(cast(Any, "door")), "no target 'door'; there are obj"),
    ],
)
def test_a_goal_that_is_no_goal_is_refused_when_it_is_made(make: Any, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        make()
