from itertools import pairwise

import numpy as np
import pytest
from robots import VX300S
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.cell import Box
from regrasp.motion.failure import PlanningError
from regrasp.motion.planning.planner import PlannerParameters, plan
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.scene.collision import CollisionModel, CollisionParameters

KIN = ArmKinematics(VX300S, RigidTransform.identity())
FLOOR = Box(name="floor", center=(0.2, 0, -0.02), size=(2.4, 2.4, 0.04))
POST = Box(name="post", center=(0.5, 0.0, 0.25), size=(0.06, 0.06, 0.5))
MODEL = CollisionModel(KIN, [FLOOR, POST])
LEFT = np.array([0.7, 0.0, 0.0, 0.0, 0.3, 0.0])
RIGHT = np.array([-0.7, 0.0, 0.0, 0.0, 0.3, 0.0])


def free_everywhere(model: CollisionModel, path: FloatArray, margin: float) -> bool:
    """Independent of the planner's own check: four times as fine."""
    for a, b in pairwise(path):
        for s in np.linspace(0, 1, 1 + int(np.abs(b - a).max() / 0.0025)):
            if not model.free(a + s * (b - a), margin):
                return False
    return True


def test_straight_when_that_is_free() -> None:
    assert plan(MODEL, LEFT, (LEFT + 0.2)[None], seed=1) == pytest.approx(np.array([LEFT, LEFT + 0.2]))


@pytest.mark.parametrize("seed", range(5))
def test_round_the_post_free_at_a_fine_step(seed: int) -> None:
    path = plan(MODEL, LEFT, RIGHT[None], seed=seed, margin=0.01)
    assert len(path) > 2
    assert path[0] == pytest.approx(LEFT)
    assert path[-1] == pytest.approx(RIGHT)
    assert free_everywhere(MODEL, path, 0.009)


def test_same_seed_same_path() -> None:
    first, again = (plan(MODEL, LEFT, RIGHT[None], seed=7) for _ in range(2))
    assert np.array_equal(first, again)
    other = plan(MODEL, LEFT, RIGHT[None], seed=8)
    assert other.shape != first.shape or not np.array_equal(first, other)


def test_goals_that_are_not_free_are_left_out() -> None:
    blocked = np.array([0.0, 0.0, 0.0, 0.0, 0.3, 0.0])
    path = plan(MODEL, LEFT, np.array([blocked, RIGHT]), seed=0)
    assert path[-1] == pytest.approx(RIGHT)
    with pytest.raises(PlanningError, match=r"none of 1 goals keeps 10 mm: the best has -\d+ mm to post") as caught:
        plan(MODEL, LEFT, blocked[None], seed=0)
    assert caught.value.code is CauseCode.NO_COLLISION_FREE_GOAL
    with pytest.raises(PlanningError) as caught:
        plan(MODEL, LEFT, np.empty((0, 6)), seed=0)
    assert caught.value.code is CauseCode.OUT_OF_REACH


def test_a_touching_start_says_what_and_how_deep() -> None:
    with pytest.raises(PlanningError, match=r"the arm touches post, \d+ mm deep") as caught:
        plan(MODEL, np.array([0.0, 0.0, 0.0, 0.0, 0.3, 0.0]), RIGHT[None], seed=0)
    assert caught.value.code is CauseCode.MOTION_BLOCKED


def test_the_budget_ends_a_search_without_a_way() -> None:
    walls = [
        Box(name="front wall", center=(0.6, 0.0, 0.6), size=(0.9, 0.02, 1.2)),
        Box(name="back wall", center=(-0.6, 0.0, 0.6), size=(0.9, 0.02, 1.2)),
        Box(name="lid", center=(0.0, 0.0, 0.8), size=(0.3, 0.02, 0.7)),
    ]
    model = CollisionModel(KIN, walls)
    up = np.array([1.2, 0.3, 0.3, 0.0, 0.0, 0.0])
    with pytest.raises(PlanningError, match="no path to 1 goals at 10 mm margin in 3000 checked") as caught:
        plan(model, up, (up * [-1, 1, 1, 1, 1, 1])[None], seed=0, parameters=PlannerParameters(max_checks=3000))
    assert caught.value.code is CauseCode.PLANNING_FAILED


def test_a_start_nearer_than_the_margin_is_led_away_with_growing_clearance() -> None:
    face = float(KIN.tool(LEFT).translation[1]) + 0.12
    panel = Box(name="panel", center=(0.4, face + 0.05, 0.3), size=(1.0, 0.1, 0.6))
    q = LEFT
    model = CollisionModel(KIN, [FLOOR, panel])
    while model.clearance(q) > 0.005:
        q = q + np.array([0.005, 0, 0, 0, 0, 0])
    assert 0 < model.clearance(q) < 0.01
    path = plan(model, q, RIGHT[None], seed=0, margin=0.02)
    first = [model.clearance(p) for p in path]
    inside = 1 + next(i for i, c in enumerate(first) if c >= 0.02)
    assert first[:inside] == sorted(first[:inside])
    assert free_everywhere(model, path[inside - 1 :], 0.019)


def test_a_way_that_coarse_checks_miss_is_found_by_fine_ones() -> None:
    blind = CollisionModel(KIN, [FLOOR, POST], parameters=CollisionParameters(coarse_step=10.0))
    assert blind.edge_free(LEFT, RIGHT, 0.01), "coarsely the post is not there"
    path = plan(blind, LEFT, RIGHT[None], seed=0, margin=0.01)
    assert free_everywhere(MODEL, path, 0.007)


def test_a_start_a_little_past_a_limit_is_led_back() -> None:
    start = LEFT.copy()
    start[5] = KIN.upper[5] + 0.02
    path = plan(MODEL, start, RIGHT[None], seed=0, margin=0.01)
    assert path[0] == pytest.approx(start)
    assert path[1] == pytest.approx(np.clip(start, KIN.lower, KIN.upper))
    assert free_everywhere(MODEL, path[1:], 0.007)
    start[5] = KIN.upper[5] + 0.2
    with pytest.raises(PlanningError, match=r"past its limits: wrist_rotate 3\.342, limits") as caught:
        plan(MODEL, start, RIGHT[None], seed=0)
    assert caught.value.code is CauseCode.MOTION_BLOCKED


def test_goals_past_the_limits_do_not_count() -> None:
    past = RIGHT.copy()
    past[1] = 2.0
    path = plan(MODEL, LEFT, np.array([past, RIGHT]), seed=0)
    assert path[-1] == pytest.approx(RIGHT)
    blocked = np.array([0.0, 0.0, 0.0, 0.0, 0.3, 0.0])
    with pytest.raises(PlanningError, match=r"none of 2 goals keeps 10 mm: the best has -\d+ mm to post"):
        plan(MODEL, LEFT, np.array([past, blocked]), seed=0)
    with pytest.raises(PlanningError, match=r"limits: shoulder 2, limits -1\.85 to 1\.257") as caught:
        plan(MODEL, LEFT, past[None], seed=0)
    assert caught.value.code is CauseCode.OUT_OF_REACH


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_numbers_that_are_not_finite_are_refused(value: float) -> None:
    wrong = RIGHT.copy()
    wrong[3] = value
    with pytest.raises(ValueError, match="the goals' joints: 1 of 6 numbers are not finite"):
        plan(MODEL, LEFT, wrong[None], seed=0)
    with pytest.raises(ValueError, match="the start's joints: 1 of 6 numbers are not finite"):
        plan(MODEL, wrong, LEFT[None], seed=0)
    with pytest.raises(ValueError, match="the margin is"):
        plan(MODEL, LEFT, RIGHT[None], seed=0, margin=value)
