import colorsys

import numpy as np
import pytest
from raycast import IDEAL, MIDDLE_THIRD, PURPLE, RED, WOOD, Ball, Block, Cylinder, Sensor, render
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.perception.pose.cable_end import cable_leaves

EYE = RigidTransform.identity()
MIDDLE = np.array([0.0, 0.0, 0.75])
WALL = Block(np.array([-3.0, -3.0, 0.87]), np.array([3.0, 3.0, 0.97]), WOOD)
Thing = Cylinder | Block | Ball


def turned(in_image: float, to_camera: float) -> np.ndarray:
    return np.asarray(Rotation.from_euler("ZY", [in_image, to_camera], degrees=True).apply([1.0, 0.0, 0.0]))


def ends(axis: np.ndarray, *things: Thing, sensor: Sensor | None = None) -> tuple[bool | None, bool | None]:
    """What is seen at the connector's end against the axis, where the cable belongs, and at its tip."""
    frame = render([WALL, Cylinder(MIDDLE, axis), *things], EYE, MIDDLE_THIRD, sensor or Sensor(), 3)
    behind, tip = (
        cable_leaves(frame.depth, MIDDLE + way * 0.045 * axis, way * axis, MIDDLE_THIRD) for way in (-1.0, 1.0)
    )
    return behind, tip


def cable(axis: np.ndarray, color: tuple[float, float, float] = (0.06, 0.06, 0.06)) -> Cylinder:
    return Cylinder(MIDDLE - 0.095 * axis, axis, 0.1, 0.0035, color)


@pytest.mark.parametrize("in_image", [0.0, 35.0, 90.0, 140.0, 180.0, 270.0])
@pytest.mark.parametrize("to_camera", [-30.0, 0.0, 30.0])
def test_the_cable_is_at_its_end_and_not_at_the_tip(in_image: float, to_camera: float) -> None:
    axis = turned(in_image, to_camera)
    behind, tip = ends(axis, cable(axis))
    assert behind is True
    assert tip is not True


@pytest.mark.parametrize("color", [RED, *(colorsys.hsv_to_rgb(hue, 0.9, 0.8) for hue in (0.15, 0.4, 0.6)), WOOD])
def test_its_colour_does_not_matter(color: tuple[float, float, float]) -> None:
    axis = turned(20.0, 0.0)
    assert ends(axis, cable(axis, color))[0] is True


def test_a_rod_without_a_cable_is_bare_at_both_ends() -> None:
    axis = turned(20.0, 0.0)
    assert ends(axis, sensor=IDEAL) == (False, False)


def test_a_bent_cable_is_one_too() -> None:
    axis, bent = turned(0.0, 0.0), turned(25.0, 0.0)
    end = MIDDLE - 0.045 * axis
    assert ends(axis, Cylinder(end - 0.05 * bent, bent, 0.1, 0.0035, (0.06, 0.06, 0.06)))[0] is True


def test_a_socket_is_no_cable() -> None:
    axis = turned(0.0, 0.0)
    socket = Block(np.array([0.040, -0.03, 0.72]), np.array([0.10, 0.03, 0.78]), PURPLE)
    assert ends(axis, cable(axis), socket)[1] is not True


def test_what_is_hidden_tells_nothing() -> None:
    axis = turned(0.0, 0.0)
    before = Block(np.array([-0.12, -0.1, 0.60]), np.array([-0.04, 0.1, 0.62]), PURPLE)
    assert ends(axis, cable(axis), before)[0] is None


@pytest.mark.parametrize("to_camera", [70.0, 90.0, -75.0])
def test_along_the_line_of_sight_nothing_is_told(to_camera: float) -> None:
    axis = turned(0.0, to_camera)
    assert ends(axis, cable(axis)) == (None, None)


def test_beyond_the_image_nothing_is_told() -> None:
    depth = np.full((240, 280), 0.87, np.float32)
    assert cable_leaves(depth, np.array([0.157, 0.0, 0.75]), np.array([1.0, 0.0, 0.0]), MIDDLE_THIRD) is None


def test_a_depth_without_readings_tells_nothing() -> None:
    depth = np.zeros((240, 280), np.float32)
    assert cable_leaves(depth, MIDDLE, np.array([1.0, 0.0, 0.0]), MIDDLE_THIRD) is None
