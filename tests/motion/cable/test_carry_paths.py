from collections.abc import Generator, Iterable

import numpy as np
from robots import VX300S
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import Box
from regrasp.motion.cable.carry_paths import first_free
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.scene.collision import Clearances, CollisionModel

KIN = ArmKinematics(VX300S, RigidTransform.identity())
START = np.array([0.0, -0.6, 0.6, 0.0, 0.3, 0.0])
LEAVING = 0.03
WIDEST = Clearances().near_margins[0]


def turned(angle: float) -> FloatArray:
    """A path from the start on which the waist turns by `angle` rad in small steps."""
    return np.array([START + share * angle * np.eye(6)[0] for share in np.linspace(0.0, 1.0, 30)])


def found(
    steps: Generator[None, None, FloatArray | None],
) -> tuple[FloatArray | None, int]:
    """What the steps return, and how many steps were taken before."""
    count = 0
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value, count
        count += 1


def search(boxes: list[Box], paths: Iterable[FloatArray | None]) -> tuple[FloatArray | None, int]:
    return found(first_free([CollisionModel(KIN, boxes)], Clearances(), LEAVING, paths))


def box_beside(gap: float) -> Box:
    """A wall to the left of the hand, `gap` m from it."""
    spheres = CollisionModel(KIN, []).spheres(START)
    hand = spheres[CollisionModel(KIN, []).links == len(KIN)]
    face = float((hand[:, 1] + hand[:, 3]).max()) + gap
    center = (float(hand[:, 0].mean()), face + 0.05, float(hand[:, 2].mean()))
    return Box(name="wall", center=center, size=(0.4, 0.1, 0.4), color=(0.5, 0.5, 0.5))


def test_a_hand_beside_a_thing_takes_the_path_that_leaves_it_though_another_comes_first() -> None:
    wall = box_beside(0.5 * WIDEST)
    model = CollisionModel(KIN, [wall])
    assert 0.0 < model.clearance(START) < WIDEST
    along, away = turned(0.005), turned(-0.5)
    assert model.path_free(along, 0.0)
    path, _ = search([wall], [along, away])
    assert path is away
    left = np.linalg.norm([KIN.tool(q).translation - KIN.tool(START).translation for q in away], axis=1) >= LEAVING
    assert min(model.clearance(q) for q in away[left]) >= WIDEST


def test_no_path_goes_nearer_to_the_thing_that_the_hand_begins_beside() -> None:
    path, _ = search([box_beside(0.004)], [turned(0.1)])
    assert path is None


def test_a_step_ends_at_each_pause_among_the_paths_and_with_each_margin() -> None:
    into = turned(0.3)
    path, steps = search([box_beside(0.01)], [into, None, into, None, None])
    assert path is None
    assert steps == 3 + len(Clearances().near_margins)
