import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from robots import VX300S
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import Box
from regrasp.motion.planning.separation import SeparationParameters, SpeedBySeparation
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.scene.collision import ArmBody, CollisionModel
from regrasp.motion.scene.distance_grid import DistanceGrid

KIN = ArmKinematics(VX300S, RigidTransform.identity())
HOME = np.array([0.0, -0.6, 0.6, 0.0, 0.3, 0.0])
TURN = np.eye(6)[0]  # a slope: the waist alone turns
VALUES = SeparationParameters()


def moving(model: CollisionModel) -> FloatArray:
    """The spheres (n, 4) of the moving links at HOME."""
    return model.spheres(HOME)[model.links >= KIN.robot.body.first_moving]


def beside(model: CollisionModel, clearance: float, h: float = 0.005) -> DistanceGrid:
    """A wall across x that the moving links at HOME clear by that many metres, with distances to half a voxel."""
    spheres = moving(model)
    lower, upper = spheres[:, :3].min(axis=0) - 0.1, spheres[:, :3].max(axis=0) + 0.1
    x, y, z = (np.arange(a, b, h) + 0.5 * h for a, b in zip(lower, upper, strict=True))
    wall = (spheres[:, 0] + spheres[:, 3]).max() + clearance
    distance = np.broadcast_to((wall - x)[:, None, None], (len(x), len(y), len(z)))
    return DistanceGrid(distance.astype(np.float32), lower, h)


def rate(model: CollisionModel, grid: DistanceGrid, slope: FloatArray) -> float:
    return float(SpeedBySeparation(model, grid, VALUES)(HOME[None], slope[None])[0])


@given(st.floats(-0.1, 0.2))
def test_the_speed_grows_with_the_clearance(clearance: float) -> None:
    clearances = np.array([clearance, clearance + 0.01])
    for speeds, slow, distance in (
        (VALUES.at_surfaces, VALUES.slow, VALUES.touching),
        (VALUES.at_rigid, VALUES.slowest_at_rigid, VALUES.rigid_error),
    ):
        speed, further = speeds(clearances)
        assert slow <= speed <= further
        assert (speed == np.inf) == (clearance >= VALUES.separation)
        assert (speed == slow) == (clearance <= distance)


def test_the_part_that_is_near_moves_at_the_speed_of_its_clearance() -> None:
    model = CollisionModel(KIN, [])
    far, near = rate(model, beside(model, 0.08), TURN), rate(model, beside(model, 0.01), TURN)
    assert far == np.inf
    spheres = moving(model)
    tip = np.linalg.norm(spheres[spheres[:, [0, 3]].sum(axis=1).argmax(), :2])  # m from the waist's axis
    assert near * tip == pytest.approx(VALUES.slow, rel=0.1)
    assert rate(model, beside(model, 0.03), TURN) > 2 * near
    assert rate(model, beside(model, 0.01), 0.5 * TURN) == pytest.approx(2 * near)


@pytest.mark.parametrize("what", ["box", "other arm"])
def test_a_known_box_and_another_arm_are_met_more_slowly_than_a_seen_surface(what: str) -> None:
    spheres = moving(CollisionModel(KIN, []))
    wall = (spheres[:, 0] + spheres[:, 3]).max() + VALUES.touching
    tip = spheres[spheres[:, [0, 3]].sum(axis=1).argmax(), :3]
    box = Box(name="wall", center=(wall + 0.05, 0.0, tip[2]), size=(0.1, 2.0, 0.5))
    other = np.array([[wall + 0.05, tip[1], tip[2], 0.05]])
    model = CollisionModel(KIN, [box]) if what == "box" else CollisionModel(KIN, [], other_arm=other)
    speed = rate(model, beside(model, 0.5), TURN) * np.linalg.norm(tip[:2])
    assert speed == pytest.approx(VALUES.slow_at_rigid, rel=0.1)


def test_what_does_not_move_may_be_near() -> None:
    model = CollisionModel(KIN, [])
    base = model.spheres(HOME)[model.links == 0][:1]  # the stand that is deep below the joints
    grid = DistanceGrid.from_points(base[:, :3], base[:, :3].min(0) - 0.1, base[:, :3].max(0) + 0.1, 0.01)
    clearances, _, ways = model.along(HOME[None], TURN[None], grid)
    assert clearances[ways == 0.0].min() < 0.0
    assert clearances[ways > 0.0].min() > VALUES.separation
    assert rate(model, grid, TURN) == np.inf


def test_what_the_hand_carries_counts() -> None:
    alone = CollisionModel(KIN, [])
    grid = beside(alone, 0.07)
    carries = CollisionModel(KIN, [], ArmBody(carried=np.array([[0.06, 0.0, 0.0, 0.01]])))
    assert rate(alone, grid, TURN) == np.inf
    assert rate(carries, grid, TURN) < np.inf


@pytest.mark.parametrize(("clearance", "near"), [(0.08, False), (0.02, True)])
def test_an_arm_is_near_to_a_surface_within_the_separation(clearance: float, near: bool) -> None:
    model = CollisionModel(KIN, [])
    assert SpeedBySeparation(model, beside(model, clearance), VALUES).near(HOME) is near


@pytest.mark.parametrize(("gap", "near"), [(0.08, False), (0.02, True)])
def test_an_arm_is_near_to_another_arm_within_the_separation(gap: float, near: bool) -> None:
    alone = CollisionModel(KIN, [])
    spheres = moving(alone)
    beyond = (spheres[:, 0] + spheres[:, 3]).max() + gap
    tip = spheres[spheres[:, [0, 3]].sum(axis=1).argmax()]
    other = np.array([[beyond + 0.05, tip[1], tip[2], 0.05]])
    model = CollisionModel(KIN, [], other_arm=other)
    assert SpeedBySeparation(model, beside(model, 0.5), VALUES).near(HOME) is near
