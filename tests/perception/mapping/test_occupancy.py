from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray
from raycast import BLACK, CONNECTOR, PURPLE, REAR_POSE, RED, WOOD, Block, Cylinder, Sensor, render
from scipy.spatial import cKDTree
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cable.cell import Connector
from regrasp.interfaces.cell import OPTICAL, Box, MappedRegion, pose_along
from regrasp.interfaces.frame import Intrinsics
from regrasp.perception.mapping.occupancy import Occupancy, OccupancyParameters, Spared, Voxel, near_boxes

Points = NDArray[np.float64]
REAR = Intrinsics.from_fov(848, 480, np.deg2rad(65.0))
WRIST = Intrinsics.from_fov(848, 480, np.deg2rad(69.4))
REGION = MappedRegion(lower=(0.0, -0.45, 0.0), upper=(0.52, 0.45, 0.65), voxel=0.015)
PARAMETERS = OccupancyParameters()
KNOWN = [
    Box(name="floor", center=(0.2, 0.0, -0.02), size=(2.4, 2.4, 0.04)),
    Box(name="back_panel", center=(0.5145, 0.0, 0.305), size=(0.013, 0.9144, 0.6096)),
]
TALL = Block(np.array([0.30, -0.06, 0.0]), np.array([0.38, 0.06, 0.36]), PURPLE)
CELL: list[Cylinder | Block] = [
    Block(np.array(b.center) - np.array(b.size) / 2, np.array(b.center) + np.array(b.size) / 2, WOOD) for b in KNOWN
]
CABLE = Cylinder(np.array([0.36, -0.25, 0.25]), np.array([0.0, 1.0, 0.1]), 0.4, 0.0035, BLACK)
HIDDEN_END = Cylinder(np.array([0.43, 0.0, 0.25]), np.array([0.0, 1.0, 0.1]), color=RED)


def empty(connector: Connector) -> Occupancy:
    return Occupancy(
        REGION,
        KNOWN,
        Spared(connector.color, 2 * connector.radius),
    )


def looking(position: tuple[float, float, float], direction: tuple[float, float, float]) -> RigidTransform:
    return RigidTransform.from_components(position, pose_along(position, direction).rotation * OPTICAL)


def integrate(
    occupancy: Occupancy,
    things: Sequence[Cylinder | Block],
    world_from_camera: RigidTransform,
    k: Intrinsics = REAR,
    ignore: Sequence[tuple[Points, Points]] = (),
    scale: float = 0.015,
) -> None:
    frame = render([*CELL, *things], world_from_camera, k, Sensor(scale=scale, gray_noise=2.0), 11)
    occupancy.integrate(frame, world_from_camera, ignore)


def outside(points: Points, block: Block) -> Points:
    """Distance (n,) of points from a block."""
    beyond = np.maximum(np.maximum(block.lower - points, points - block.upper), 0.0)
    return np.asarray(np.linalg.norm(beyond, axis=1))


def farthest(points: Points, targets: Points) -> float:
    """Metres from that target to its nearest point that has it farthest."""
    return float(np.max(cKDTree(points).query(targets)[0]))


def inside(block: Block) -> Points:
    """Points of a block's inside above the floor's margin."""
    lower = np.maximum(block.lower + 0.005, [0.0, -1.0, 0.05])
    axes = [np.arange(a, b, 0.015) for a, b in zip(lower, block.upper - 0.005, strict=True)]
    return np.stack(np.meshgrid(*axes), -1).reshape(-1, 3)


def test_an_obstacle_is_covered_and_nothing_else_is() -> None:
    occupancy = empty(CONNECTOR)
    integrate(occupancy, [TALL, CABLE, HIDDEN_END], REAR_POSE)
    points = occupancy.occupied_points()
    assert farthest(points, inside(TALL)) < occupancy.voxel_size
    assert outside(points, TALL).max() < 0.03  # depth scale, camera ray, a voxel


@pytest.mark.parametrize("scale", [-0.015, 0.0, 0.015])
def test_an_empty_cell_with_cable_and_connector_stays_empty(scale: float) -> None:
    occupancy = empty(CONNECTOR)
    integrate(occupancy, [CABLE, HIDDEN_END], REAR_POSE, scale=scale)
    assert len(occupancy.occupied_points()) == 0


def test_the_wrist_camera_close_by_takes_no_cable_for_an_obstacle() -> None:
    occupancy = empty(CONNECTOR)
    near = looking((0.15, -0.25, 0.33), (0.21, 0.0, -0.08))
    integrate(occupancy, [CABLE], near, WRIST)
    assert len(occupancy.occupied_points()) == 0


def test_a_black_obstacle_is_an_obstacle() -> None:
    occupancy = empty(CONNECTOR)
    block = Block(TALL.lower, TALL.upper, BLACK)
    integrate(occupancy, [block], REAR_POSE)
    assert farthest(occupancy.occupied_points(), inside(block)) < 2 * occupancy.voxel_size


def test_the_robot_is_no_obstacle() -> None:
    arm = Cylinder(np.array([0.2, 0.2, 0.3]), np.array([0.3, 0.1, 1.0]), 0.3, 0.03, (0.3, 0.3, 0.3))
    axis = arm.axis / np.linalg.norm(arm.axis)
    spheres = (arm.center + np.linspace(-0.15, 0.15, 11)[:, None] * axis, np.full(11, 0.035))
    seen, ignored = empty(CONNECTOR), empty(CONNECTOR)
    integrate(seen, [arm], REAR_POSE)
    integrate(ignored, [arm], REAR_POSE, ignore=[spheres])
    assert len(seen.occupied_points()) > 100
    assert len(ignored.occupied_points()) == 0


def test_a_thing_is_three_centimetres_deep_at_least_and_beyond_that_it_may_end() -> None:
    occupancy = empty(CONNECTOR)
    integrate(occupancy, [TALL], REAR_POSE)
    front = float(TALL.lower[0])
    sure, perhaps = occupancy.occupied_points(Voxel.INSIDE), occupancy.unseen_points()
    assert front + 0.02 < sure[:, 0].max() < front + 0.05
    assert perhaps[:, 0].min() > front + 0.02
    assert front + 0.06 < perhaps[:, 0].max() < front + 0.10
    assert len(sure) + len(perhaps) == len(occupancy.occupied_points())


def test_a_thing_may_reach_still_further_into_its_shadow() -> None:
    deep = Block(np.array([0.20, -0.08, 0.0]), np.array([0.40, 0.08, 0.36]), PURPLE)
    occupancy = empty(CONNECTOR)
    integrate(occupancy, [deep], REAR_POSE)
    unmapped = inside(deep)
    unmapped = unmapped[cKDTree(occupancy.occupied_points()).query(unmapped)[0] > 0.02]
    assert len(unmapped) > 1000
    assert farthest(occupancy.shadow_points(), unmapped) < 2 * occupancy.voxel_size
    assert occupancy.shadow_points()[:, 0].max() < 0.20 + PARAMETERS.shadow_depth + 0.02


def test_a_look_from_the_side_clears_what_was_assumed_behind() -> None:
    thin = Block(np.array([0.30, -0.06, 0.0]), np.array([0.32, 0.06, 0.36]), PURPLE)
    occupancy = empty(CONNECTOR)
    integrate(occupancy, [thin], REAR_POSE)
    assert np.count_nonzero(outside(occupancy.occupied_points(), thin) > 0.04) > 100
    integrate(occupancy, [thin], looking((0.36, 0.35, 0.5), (0.0, -0.8, -0.6)), WRIST)
    behind = occupancy.occupied_points()
    behind = behind[(behind[:, 0] > 0.36) & (np.abs(behind[:, 1]) < 0.05) & (behind[:, 2] < 0.33)]
    assert len(behind) == 0
    assert farthest(occupancy.occupied_points(), inside(thin)) < 0.02


def test_the_connectors_own_place_is_freed_when_it_is_found() -> None:
    end = Cylinder(np.array([0.36, 0.0, 0.25]), np.array([0.0, 1.0, 0.1]), color=RED)
    thin = Block(np.array([0.30, -0.06, 0.0]), np.array([0.31, 0.06, 0.36]), PURPLE)
    occupancy = empty(CONNECTOR)
    integrate(occupancy, [thin, end], REAR_POSE)
    assert farthest(occupancy.occupied_points(), end.center[None]) < occupancy.voxel_size  # the guess covers it
    integrate(occupancy, [thin, end], looking((0.40, 0.12, 0.55), (-0.04, -0.12, -0.3)), WRIST)
    assert farthest(occupancy.occupied_points(), end.center[None]) > 0.015


def test_known_boxes_have_a_margin() -> None:
    points = np.array(
        [[0.4, 0.0, 0.3], [0.485, 0.0, 0.3], [0.52, 0.0, 0.3], [0.2, 0.0, PARAMETERS.known_margin + 0.001]]
    )
    assert near_boxes(points, KNOWN, PARAMETERS.known_margin).tolist() == [False, True, True, False]
