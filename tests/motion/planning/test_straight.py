from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cause import CauseCode
from regrasp.motion.failure import PlanningError
from regrasp.motion.planning.straight import straight_line
from regrasp.motion.robots.kinematics import ArmKinematics

Q0 = np.array([0.1, -0.6, 0.7, 0.2, 0.4, -0.1])


def test_tool_stays_on_the_line_between_the_waypoints(right_arm: ArmKinematics) -> None:
    start = right_arm.tool(Q0)
    goal = RigidTransform.from_components(
        start.translation + np.array([0.08, 0.05, 0.02]), start.rotation * Rotation.from_euler("z", 0.3)
    )
    path = straight_line(right_arm, Q0, goal)
    assert path[0] == pytest.approx(Q0)
    assert right_arm.tool(path[-1]).translation == pytest.approx(goal.translation, abs=1e-4)
    assert (right_arm.tool(path[-1]).rotation.inv() * goal.rotation).magnitude() < 1e-3
    way = (goal.translation - start.translation) / np.linalg.norm(goal.translation - start.translation)
    for a, b in pairwise(path):
        for s in (0.0, 0.5):
            offset = right_arm.tool(a + s * (b - a)).translation - start.translation
            assert np.linalg.norm(offset - (offset @ way) * way) < 0.001
    steps = np.diff([right_arm.tool(q).translation for q in path], axis=0)
    assert np.linalg.norm(steps, axis=1).max() < 0.0051


def test_a_line_out_of_reach_says_how_far_it_came(right_arm: ArmKinematics) -> None:
    goal = RigidTransform.from_translation([0.6, 0.0, 0.0]) * right_arm.tool(Q0)
    with pytest.raises(PlanningError, match=r"straight line of 0.600 m stops after 0.\d+ m") as caught:
        straight_line(right_arm, Q0, goal)
    assert caught.value.code is CauseCode.OUT_OF_REACH
