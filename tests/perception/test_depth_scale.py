import numpy as np
import pytest
from raycast import PURPLE, REAR_POSE, WOOD, Block, Cylinder, Sensor, render
from scipy.spatial.transform import RigidTransform, Rotation

from interfaces.cell import Box
from interfaces.frame import Intrinsics
from perception.depth_scale import panel_scale

REAR = Intrinsics.from_fov(848, 480, float(np.deg2rad(65.0)))
PANEL = Box(name="back_panel", center=(0.5145, 0.0, 0.305), size=(0.013, 0.9144, 0.6096))
WALL = Block(np.array([0.508, -0.4572, 0.0]), np.array([0.521, 0.4572, 0.6096]), WOOD)
FLOOR = Block(np.array([-1.0, -1.2, -0.04]), np.array([1.4, 1.2, 0.0]), WOOD)
TALL = Block(np.array([0.18, 0.06, 0.0]), np.array([0.26, 0.18, 0.36]), PURPLE)
Things = list[Cylinder | Block]


@pytest.mark.parametrize("scale", [-0.015, 0.0, 0.015, 0.03])
@pytest.mark.parametrize("things", [[WALL, FLOOR], [WALL, FLOOR, TALL]], ids=["free", "obstacle"])
def test_the_scale_is_recovered_within_0_3_percent(scale: float, things: Things) -> None:
    frame = render(things, REAR_POSE, REAR, Sensor(scale=scale), 3)
    found = panel_scale(frame, REAR_POSE, PANEL)
    assert found is not None
    assert found * (1 + scale) == pytest.approx(1.0, abs=0.003)


def test_a_camera_turned_by_0_3_degrees_costs_less_than_a_fifth_of_the_scale_error() -> None:
    believed = REAR_POSE * RigidTransform.from_components(
        [0.002, 0.002, 0.002], Rotation.from_euler("y", 0.3, degrees=True)
    )
    found = panel_scale(render([WALL, FLOOR], REAR_POSE, REAR, Sensor(scale=0.015), 3), believed, PANEL)
    assert found is not None
    assert found * 1.015 == pytest.approx(1.0, abs=0.003)


def test_a_hidden_panel_gives_no_scale() -> None:
    before = Block(np.array([0.20, -2.0, -0.5]), np.array([0.25, 2.0, 2.0]), PURPLE)
    assert panel_scale(render([WALL, before], REAR_POSE, REAR, Sensor(), 3), REAR_POSE, PANEL) is None


def test_a_frame_without_readings_gives_no_scale() -> None:
    frame = render([], REAR_POSE, REAR, Sensor(), 3)
    assert not frame.depth.any()
    assert panel_scale(frame, REAR_POSE, PANEL) is None
