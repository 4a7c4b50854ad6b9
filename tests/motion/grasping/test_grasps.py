from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.cell import Box, pose_along
from regrasp.motion.failure import PlanningError
from regrasp.motion.grasping.grasps import GraspParameters, choose_grasp, grasp_candidates
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.scene.collision import CollisionModel

LENGTH, RADIUS = 0.09, 0.01


@settings(max_examples=25, deadline=None)  # each looks at a thousand grasps
@given(st.tuples(*(st.floats(-1, 1) for _ in range(4))).filter(lambda q: sum(x * x for x in q) > 0.1))
def test_jaws_close_across_the_connector(quaternion: tuple[float, ...]) -> None:
    connector = RigidTransform.from_components([0.3, 0.1, 0.2], Rotation.from_quat(quaternion))
    axis = connector.rotation.apply([1, 0, 0])
    grasps = grasp_candidates(connector, LENGTH, RADIUS, grip_offset=-0.02)
    for grasp in grasps:
        x, y, z = grasp.world_from_tool.rotation.as_matrix().T
        assert y @ axis == pytest.approx(0.0, abs=1e-9)
        assert np.cross(x, y) == pytest.approx(z)
        assert 40 - 1e-6 <= np.rad2deg(np.arccos(abs(x @ axis))) <= 90 + 1e-6
        assert grasp.world_from_tool.translation == pytest.approx(connector.translation - 0.02 * axis)
    assert [g.cost for g in grasps] == sorted(g.cost for g in grasps)
    best = grasps[0].world_from_tool.rotation.as_matrix()[:, 0]
    assert best @ axis == pytest.approx(
        np.sin(GraspParameters().preferred_yaw)
    )  # moves towards the tip: the palm is on the cable's side
    opposite = grasps[0].world_from_tool.rotation.inv() * grasps[1].world_from_tool.rotation
    assert opposite.magnitude() == pytest.approx(np.pi)


def test_a_shallow_grasp_holds_nearer_to_the_finger_tips() -> None:
    connector = pose_along((0.3, 0.1, 0.2), (0, 1, 0))
    for deep, shallow in zip(
        grasp_candidates(connector, LENGTH, RADIUS),
        grasp_candidates(connector, LENGTH, RADIUS, shallow=0.01),
        strict=True,
    ):
        back = deep.world_from_tool.inv() * shallow.world_from_tool
        assert back.translation == pytest.approx([-0.01, 0, 0], abs=1e-9)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"grip_offset": 0.05}, "off a connector"),
        ({"parameters": GraspParameters(yaws=(1.0,))}, "50 degrees"),
        ({"radius": 0.05, "opening": 0.075}, "does not fit"),
    ],
)
def test_what_cannot_be_asked(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        grasp_candidates(pose_along((0.3, 0, 0.2), (0, 1, 0)), **{"length": LENGTH, "radius": RADIUS, **arguments})  # type: ignore[arg-type]


def tilted(position: tuple[float, float, float], degrees: float) -> RigidTransform:
    return pose_along(position, (0.0, float(np.cos(np.deg2rad(degrees))), -float(np.sin(np.deg2rad(degrees)))))


@pytest.mark.parametrize("place", ["plugged", "seat", "high", "low"])
def test_the_right_arm_grasps_the_connector_of_the_thesis_cell(
    place: str, known: CableKnown, boxes: Sequence[Box], right_arm: ArmKinematics
) -> None:
    connector = {
        "plugged": known.cable.socket(known.cable.plugged_into).world_from_plug(LENGTH),
        "seat": known.cable.clip.world_from_seat,
        "high": tilted((0.36, 0.14, 0.25), 0),
        "low": tilted((0.35, 0.12, 0.10), 25),
    }[place]
    left = known.arm("left")
    other = CollisionModel(ArmKinematics(left.robot, left.world_from_base), []).spheres(np.array(left.sleep))
    model = CollisionModel(right_arm, boxes, other_arm=other)
    sleep = np.array(known.arm("right").sleep)
    choice = choose_grasp(right_arm, model, sleep, grasp_candidates(connector, LENGTH, RADIUS))
    assert choice.paths
    for path in choice.paths:
        tool = right_arm.tool(path[-1])
        assert tool.translation == pytest.approx(choice.grasp.world_from_tool.translation, abs=1e-4)
        back = tool.inv() * right_arm.tool(path[0])
        assert back.translation == pytest.approx([-0.08, 0, 0], abs=2e-4)
        assert all(model.free(q, 0.002) for q in path)
        assert model.free(path[0], 0.01)


def test_a_failure_tallies_why(right_arm: ArmKinematics, boxes: Sequence[Box]) -> None:
    model = CollisionModel(right_arm, boxes)
    far = grasp_candidates(tilted((0.3, 0.9, 0.3), 0), LENGTH, RADIUS)
    with pytest.raises(PlanningError, match=f"{len(far)} grasp candidates: {len(far)} out of reach") as caught:
        choose_grasp(right_arm, model, np.zeros(6), far)
    assert caught.value.code is CauseCode.OUT_OF_REACH
    inside = grasp_candidates(tilted((0.5145, 0.0, 0.3), 0), LENGTH, RADIUS)
    with pytest.raises(PlanningError, match="in collision with back_panel") as caught:
        choose_grasp(right_arm, model, np.zeros(6), inside)
    assert caught.value.code is CauseCode.NO_COLLISION_FREE_GOAL
