import numpy as np
import pytest
from arm_surface import surface
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from robots import VX300S
from scipy.spatial.transform import RigidTransform

from regrasp.motion.robots.arm_offsets import joint_offsets
from regrasp.motion.robots.kinematics import ArmKinematics

Floats = NDArray[np.float64]
KIN = ArmKinematics(VX300S, RigidTransform.identity())
READY = np.array([0.4, -0.3, 0.4, 0.5, 0.3, 0.2])
GAP = 0.05


def seen(q: Floats) -> Floats:
    return surface(KIN, q, GAP)


def tool_error(q: Floats, truth: Floats) -> float:
    return float(np.linalg.norm(KIN.tool(q).translation - KIN.tool(truth).translation))


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(-0.04, 0.04), min_size=6, max_size=6))
def test_the_tool_lies_where_the_arm_is_seen(offsets: list[float]) -> None:
    truth = READY + offsets
    corrected = READY + joint_offsets(KIN, READY, GAP, seen(truth))
    assert tool_error(corrected, truth) < max(0.004, 0.35 * tool_error(READY, truth))


def test_an_arm_that_is_where_its_encoders_say_stays_there() -> None:
    assert tool_error(READY + joint_offsets(KIN, READY, GAP, seen(READY)), READY) < 0.0005


def test_things_beside_the_arm_do_not_draw_it() -> None:
    truth = READY + np.array([0.03, 0.02, 0.01, 0.03, -0.02, 0.03])
    beside = KIN.tool(truth).apply([0.02, 0.0, -0.09])
    steps = np.arange(-0.03, 0.03, 0.004)
    board = beside + np.stack(np.meshgrid(steps, steps, [0.0]), -1).reshape(-1, 3)
    corrected = READY + joint_offsets(KIN, READY, GAP, np.vstack([seen(truth), board]))
    assert tool_error(READY, truth) > 0.009
    assert tool_error(corrected, truth) < 0.004


@pytest.mark.parametrize("points", [np.empty((0, 3)), seen(READY + 0.02)[::40], seen(READY) + np.array([0, 0, 1.0])])
def test_where_little_of_it_is_seen_the_encoders_count(points: Floats) -> None:
    assert not joint_offsets(KIN, READY, GAP, points).any()
