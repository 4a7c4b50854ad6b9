"""The cable as a constraint on where an arm may take its end."""

from collections.abc import Sequence

import numpy as np
import pytest
from fake_devices import Rig
from natural import natural_pose
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.motion.cable.cable_shape import cable_course
from regrasp.motion.cable.tether import Tether
from regrasp.motion.scene.distance_grid import FREE_DISTANCE, DistanceGrid

NOTHING = DistanceGrid(np.full((1, 1, 1), FREE_DISTANCE, np.float32), np.zeros(3), 1e-3)
STRAIGHT = np.zeros(3)
BENT = np.array([-0.05, 0.0, 0.08])


class Held:
    """The right arm with the connector in its hand, first where the cable bends by `off` (3,) m."""

    def __init__(self, known: CableKnown, off: FloatArray = STRAIGHT) -> None:
        rig = Rig(known)
        self.known, self.kin = known, rig.motion.kinematics["right"]
        connector = natural_pose(known, off)
        rig.run(rig.motion.pick("right", connector, known.cable.connector))
        self.start = rig.motion.joints("right")
        self.held = rig.motion.tool("right").inv() * connector

    def at(self, connector: RigidTransform) -> FloatArray:
        """The joints (6,) at which it holds the connector there."""
        found: FloatArray = self.kin.ik(connector * self.held.inv(), self.start)[0]
        return found

    def tether(
        self, grid: DistanceGrid = NOTHING, max_bend: float = np.inf, caught: Sequence[FloatArray] = ()
    ) -> Tether:
        return Tether(self.known, self.held, self.start, self.kin, [], grid, max_bend, caught=caught)


@pytest.fixture(scope="module")
def held(known: CableKnown) -> Held:
    return Held(known)


def grid_of(points: FloatArray) -> DistanceGrid:
    return DistanceGrid.from_points(points, points.min(axis=0) - 0.2, points.max(axis=0) + 0.2, 0.01)


def test_the_cable_reaches_as_far_as_it_is_long(held: Held) -> None:
    tether, natural = held.tether(), natural_pose(held.known, BENT)
    _, course = held.known.cable.anchor
    assert tether.holds(held.at(natural))
    for further, reaches in ((0.01, False), (-0.01, True)):
        moved = RigidTransform.from_translation(further * course) * natural
        assert tether.holds(held.at(moved)) is reaches


def test_a_cable_that_is_pressed_together_bends_too_much(held: Held) -> None:
    _, course = held.known.cable.anchor
    pressed = held.at(RigidTransform.from_translation(-0.05 * course) * natural_pose(held.known, STRAIGHT))
    assert held.tether(max_bend=np.inf).holds(pressed)
    assert not held.tether(max_bend=7.0).holds(pressed)
    assert held.tether(max_bend=7.0).holds(held.at(natural_pose(held.known, BENT)))


def test_the_cable_does_not_sweep_through_what_stands_beside_it(held: Held) -> None:
    ends = [cable_course(held.known, natural_pose(held.known, share * BENT)) for share in (0.4, 0.6)]
    between = 0.5 * (ends[0] + ends[1])
    tether = held.tether(grid_of(between[len(between) // 2 :][:5]))
    begin, beyond = held.at(natural_pose(held.known, STRAIGHT)), held.at(natural_pose(held.known, BENT))
    assert tether.holds(begin)
    assert tether.holds(beyond)
    assert not tether.holds_along(begin, beyond)
    assert held.tether().holds_along(begin, beyond)


def test_what_touches_the_cable_at_the_start_does_not_forbid_every_way(known: CableKnown) -> None:
    bent = Held(known, BENT)
    lies_on = cable_course(known, natural_pose(known, BENT))[20:30]
    tether = bent.tether(grid_of(lies_on))
    assert tether.holds(bent.start)
    assert tether.holds(bent.at(natural_pose(known, BENT + np.array([0.0, 0.0, 0.05]))))


def cable_end(held: Held, connector: RigidTransform) -> FloatArray:
    """Where (3,) m the cable goes into the connector."""
    return connector.apply([-0.5 * held.known.cable.connector.length, 0.0, 0.0])


def test_the_cable_s_end_keeps_away_from_where_it_was_caught(held: Held) -> None:
    straight, between, beyond = (natural_pose(held.known, share * BENT) for share in (0.0, 0.5, 1.0))
    tether = held.tether(caught=[cable_end(held, between)])
    assert tether.holds(held.at(straight))
    assert tether.holds(held.at(beyond))
    assert not tether.holds_along(held.at(straight), held.at(beyond))
    assert held.tether().holds_along(held.at(straight), held.at(beyond))


@pytest.mark.parametrize("ahead", [0.0, 0.02])
def test_a_cable_caught_close_to_the_start_may_go_any_other_way(held: Held, ahead: float) -> None:
    straight, bent, other_way = (held.at(natural_pose(held.known, share * BENT)) for share in (0.0, 1.0, -1.0))
    caught = cable_end(held, natural_pose(held.known, STRAIGHT)) + ahead * BENT / np.linalg.norm(BENT)
    tether = held.tether(caught=[caught])
    assert tether.holds_along(straight, other_way)
    assert tether.holds_along(straight, bent) is (ahead == 0.0)
