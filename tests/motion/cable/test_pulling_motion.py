"""Where the cable is taken hold of, and how far it is lifted then."""

from dataclasses import replace

import numpy as np
import pytest
from fake_devices import Rig
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cause import CauseCode
from regrasp.motion.cable.cable_section import section_of_cable
from regrasp.motion.failure import PlanningError

CONNECTOR = RigidTransform.from_components([0.38, 0.0, 0.15], Rotation.from_euler("z", 90, degrees=True))


@pytest.fixture
def rig(known: CableKnown) -> Rig:
    rig = Rig(known)
    for gripper in rig.grippers.values():
        gripper.inside = 2 * known.cable.radius
    return rig


@given(place=st.floats(0.02, 0.3), yaw=st.floats(-3.0, 3.0))
def test_a_section_lies_on_the_cable_so_far_from_its_end_and_points_to_it(place: float, yaw: float) -> None:
    angles = np.linspace(0.0, 2.0, 200)  # of a bow of 0.25 m
    course = 0.25 * np.stack([np.cos(angles + yaw), np.sin(angles + yaw), 0 * angles], axis=1)
    section = section_of_cable(course, place)
    angle = 2.0 - place / 0.25 + yaw
    assert section.translation == pytest.approx(0.25 * np.array([np.cos(angle), np.sin(angle), 0.0]), abs=0.003)
    along = section.rotation.apply([1.0, 0.0, 0.0])
    assert along == pytest.approx([-np.sin(angle), np.cos(angle), 0.0], abs=0.02)


def test_the_cable_is_gripped_beside_the_connector_and_lifted(rig: Rig) -> None:
    request = rig.motion.pull_cable(CONNECTOR)
    gripped = {}
    while not request.poll():
        rig.clock.t += 0.05
        for arm, gripper in rig.grippers.items():
            if arm not in gripped and any(word == "close" for _, word, _ in gripper.told):
                gripped[arm] = rig.motion.tool(arm).translation
    (arm,) = gripped
    assert request.answer == arm
    assert 0.05 < np.linalg.norm(gripped[arm] - CONNECTOR.translation) < 0.30
    assert rig.motion.tool(arm).translation[2] > gripped[arm][2] + 0.09
    assert rig.grippers[arm].told[-1][1] == "close"


def test_the_arm_that_lets_go_of_the_cable_goes_to_sleep(rig: Rig) -> None:
    rig.run(request := rig.motion.pull_cable(CONNECTOR))
    arm = request.answer
    rig.run(rig.motion.let_go_of_cable(arm))
    assert rig.grippers[arm].told[-1][1] == "open"
    assert rig.motion.joints(arm) == pytest.approx(rig.known.arm(arm).sleep, abs=1e-3)


def test_a_lifted_cable_is_brought_to_another_place_with_room_below(rig: Rig) -> None:
    rig.run(request := rig.motion.pull_cable(CONNECTOR))
    arm, been = request.answer, [rig.motion.tool(request.answer).translation]
    turned = rig.motion.tool(arm).rotation
    y, z = np.mgrid[-0.3:0.0:0.02, 0.05:0.2:0.02]
    wall = np.column_stack([np.full(y.size, 0.3), y.ravel(), z.ravel()])
    rig.motion.set_obstacles(wall, 0.02)
    for _ in range(2):
        rig.run(rig.motion.bring_cable(arm, None))
        tool = rig.motion.tool(arm)
        assert min(np.linalg.norm(tool.translation - place) for place in been) > 0.08
        below = tool.translation - np.linspace(0.0, 0.15, 4)[:, None] * [0.0, 0.0, 1.0]
        assert np.linalg.norm(below[:, None] - wall, axis=2).min() > 0.05
        assert (tool.rotation * turned.inv()).magnitude() < 0.1
        been.append(tool.translation)
    assert rig.grippers[arm].told[-1][1] == "close"


def test_a_cable_that_can_be_brought_nowhere_is_a_named_cause(rig: Rig) -> None:
    rig.run(request := rig.motion.pull_cable(CONNECTOR))
    rig.motion.parameters = replace(
        rig.motion.parameters, pulling=replace(rig.motion.parameters.pulling, onward=(2.0,))
    )
    with pytest.raises(PlanningError, match="no way leads") as failure:
        rig.run(rig.motion.bring_cable(request.answer, None))
    assert failure.value.code is CauseCode.NO_COLLISION_FREE_GOAL


def test_a_jaw_that_closes_beside_the_cable_opens_and_the_arm_sleeps(rig: Rig) -> None:
    for gripper in rig.grippers.values():
        gripper.inside = 0.0
    with pytest.raises(PlanningError) as failure:
        rig.run(rig.motion.pull_cable(CONNECTOR))
    assert failure.value.code is CauseCode.GRASP_EMPTY
    for spec in rig.known.arms:
        assert rig.motion.joints(spec.name) == pytest.approx(spec.sleep, abs=1e-3)


def test_a_cable_that_no_arm_reaches_is_a_named_cause(rig: Rig) -> None:
    far = RigidTransform.from_translation([1.5, 0.0, 0.3]) * CONNECTOR
    with pytest.raises(PlanningError, match="no grasp of the cable is free") as failure:
        rig.run(rig.motion.pull_cable(far))
    assert failure.value.code is CauseCode.NO_COLLISION_FREE_GOAL


def test_a_pull_that_is_cancelled_halts_the_arm(rig: Rig) -> None:
    request = rig.motion.pull_cable(CONNECTOR)
    while not any(arm.is_moving() for arm in rig.arms.values()):
        assert not request.poll()
        rig.clock.t += 0.05
    request.cancel()
    assert not any(arm.is_moving() for arm in rig.arms.values())
