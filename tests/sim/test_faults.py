import numpy as np
import pytest
from hand import draw, start_to_draw, take_hold
from numpy.typing import NDArray

from interfaces.cell import Cell
from interfaces.scene import JawOpens
from sim.faults import JawOpensFault
from sim.gripper import SimGripper
from sim.world import World

FloatArray = NDArray[np.float64]
SHARE = 0.02  # of the way, late: contacts are looked at every 8 ms
OPEN_FOR = 1.0  # s
START, GOAL = np.array([0.4, 0.1, 0.4]), np.array([0.2, 0.1, 0.4])


class Jaw(SimGripper):
    """Notes how often and for how long it was made to open."""

    def __init__(self) -> None:
        self.failures: list[float] = []

    def fail_open(self, seconds: float) -> None:
        self.failures.append(seconds)


@pytest.mark.parametrize(
    ("share", "held", "opens"), [(0.49, True, False), (0.51, True, True), (0.9, False, False), (-0.6, True, False)]
)
def test_it_opens_the_jaw_of_a_held_end_that_came_far_enough(share: float, held: bool, opens: bool) -> None:
    jaw = Jaw()
    fault = JawOpensFault(JawOpens(carried=0.5, seconds=1.5), jaw, START, GOAL)
    aside = np.array([0.0, 0.3, -0.1])  # the way counts along the line only
    fault.step(2.0, START + share * (GOAL - START) + aside, held)
    assert jaw.failures == ([1.5] if opens else [])
    assert fault.fired_at == (2.0 if opens else None)


def test_it_opens_once() -> None:
    jaw = Jaw()
    fault = JawOpensFault(JawOpens(carried=0.5, seconds=1.0), jaw, START, GOAL)
    for now in (1.0, 2.0, 3.0):
        fault.step(now, GOAL, True)
    assert jaw.failures == [1.0]
    assert fault.fired_at == 1.0


def share_of_way(world: World, start: FloatArray, way: FloatArray) -> float:
    return float((world.connector_pose().translation - start) @ way) / float(way @ way)


def test_the_connector_is_really_lost(cell: Cell) -> None:
    world = World(cell, "zero", seed=3, faults=(JawOpens(carried=0.5, seconds=OPEN_FOR),), renderer="tiny")
    hand, start = world.arms["right"], world.connector_pose().translation
    way = cell.known.clip.world_from_seat.translation - start
    take_hold(world)
    draw(world, -0.06 * world.connector_pose().rotation.apply([1.0, 0.0, 0.0]), 1.5)
    draw(world, 0.25 * way, 1.5)
    assert world.faults[0].fired_at is None
    assert all(world.pads_touching("right"))

    start_to_draw(world, (0.9 - share_of_way(world, start, way)) * way, 1.5)
    while world.faults[0].fired_at is None and hand.is_moving():
        world.advance(0.01)
    assert share_of_way(world, start, way) == pytest.approx(0.5, abs=SHARE)

    world.advance(OPEN_FOR - 0.05)
    assert hand.gripper.true_gap() > 0.05
    world.advance(1.0)
    assert hand.gripper.true_gap() < 0.006  # closed again, on nothing
    assert world.pads_touching("right") == (False, False)
    apart = hand.tool_pose().translation - world.connector_pose().translation
    assert float(np.linalg.norm(apart)) > 0.05
    world.close()
