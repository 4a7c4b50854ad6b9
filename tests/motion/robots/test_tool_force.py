import numpy as np
import pytest

from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.robots.tool_force import tool_force, tool_wrench

READY = np.array([0.4, -0.6, 0.6, 0.2, 0.3, 0.1])


def power(arm: ArmKinematics, point: np.ndarray, force: np.ndarray, joint: int, step: float = 1e-6) -> float:
    """The work in J of a force on a point of the tool while a joint turns by `step` rad, by `step`."""
    ends = []
    for q in (READY, READY + step * np.eye(6)[joint]):
        ends.append(arm.tool(q).apply(arm.tool(READY).inv().apply(point)))
    return float((ends[1] - ends[0]) @ force) / step


@pytest.mark.parametrize("force", [[5.0, 0.0, 0.0], [0.0, -3.0, 1.0], [1.0, 2.0, -8.0]])
@pytest.mark.parametrize("tip", [[0.0, 0.0, 0.0], [0.0, 0.01, 0.065]])
def test_the_drives_tell_a_force_on_what_the_hand_holds(
    right_arm: ArmKinematics, force: list[float], tip: list[float]
) -> None:
    point, pushed = right_arm.tool(READY).apply(tip), np.array(force)
    efforts = np.array([-power(right_arm, point, pushed, joint) for joint in range(6)])
    assert tool_force(right_arm, READY, efforts, point) == pytest.approx(pushed, abs=1e-3)


def test_without_a_change_there_is_no_force(right_arm: ArmKinematics) -> None:
    point = right_arm.tool(READY).translation
    assert tool_force(right_arm, READY, np.zeros(6), point) == pytest.approx(np.zeros(3))


def test_a_force_with_a_moment_is_found_from_the_efforts(right_arm: ArmKinematics) -> None:
    point, wrench = (
        np.add(right_arm.tool(READY).translation, [0.05, 0.0, 0.02]),
        np.array([3.0, -2.0, 5.0, 0.2, 0.1, -0.4]),
    )
    jacobian = right_arm.jacobian(READY)
    lever = point - right_arm.tool(READY).translation
    moment = wrench[3:] + np.cross(lever, wrench[:3])  # about the tool's own point
    efforts = -jacobian.T @ np.concatenate([wrench[:3], moment])
    assert tool_wrench(right_arm, READY, efforts, point) == pytest.approx(wrench, abs=1e-6)
