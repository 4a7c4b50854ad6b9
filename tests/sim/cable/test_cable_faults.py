"""What faults do to the cable, and what they may wait for."""

import numpy as np
import pybullet as p
import pytest
from hand import draw, start_to_draw, take_hold

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.cable.fault import CableSnags, CableWhen, ConnectorKnocked, Phase
from regrasp.interfaces.fault import Fault, JawOpens, JawWeakens, PlanningFindsNothing
from regrasp.interfaces.scene import SceneSetup
from regrasp.sim.cable.objects import CableObjects, cable_world
from regrasp.sim.world import World

SHARE = 0.02  # of the way, late: contacts are looked at every 8 ms
OPEN_FOR = 1.0  # s
ON = 0.5  # s
PHASES: tuple[Phase, ...] = ("unplugged", "carried", "lost", "settled")


def at(seconds: float) -> CableWhen:
    return CableWhen(at=(seconds, seconds))


def with_fault(cell: CableCell, fault: Fault) -> World[CableObjects]:
    return cable_world(cell, "zero", 4, SceneSetup(faults=(fault,)))


def unplug(world: World[CableObjects]) -> None:
    """The socket lets go."""
    world.objects.socket._hold.release()  # type: ignore[union-attr]
    world.objects.socket._hold = None


def share_of_way(world: World[CableObjects], start: FloatArray, way: FloatArray) -> float:
    return float((world.objects.connector_pose().translation - start) @ way) / float(way @ way)


def test_phases_begin_faults_and_the_connector_is_really_lost(cell: CableCell) -> None:
    noted = [PlanningFindsNothing(type="planning_finds_nothing", when=CableWhen(phase=phase)) for phase in PHASES]
    faults: tuple[Fault, ...] = (
        JawOpens(type="jaw_opens", when=CableWhen(carried=(0.5, 0.5)), seconds=OPEN_FOR),
        *noted,
    )
    world = cable_world(cell, "zero", 3, SceneSetup(faults=faults))
    hand, start = world.arms["right"], world.objects.connector_pose().translation
    way = cell.known.cable.clip.world_from_seat.translation - start
    take_hold(world)
    draw(world, -0.06 * world.objects.connector_pose().rotation.apply([1.0, 0.0, 0.0]), 1.5)
    draw(world, 0.25 * way, 1.5)
    assert [fault.waiting for fault in world.faults] == [True, False, True, True, True]
    assert all(world.objects.pads_touching("right"))

    start_to_draw(world, (0.9 - share_of_way(world, start, way)) * way, 1.5)
    while world.faults[0].waiting and hand.is_moving():
        world.advance(0.01)
    assert share_of_way(world, start, way) == pytest.approx(0.5, abs=SHARE)

    world.advance(OPEN_FOR - 0.05)
    assert hand.gripper.true_gap() > 0.05
    world.advance(1.0)
    assert hand.gripper.true_gap() < 0.006  # closed again, on nothing
    assert world.objects.pads_touching("right") == (False, False)
    apart = hand.tool_pose().translation - world.objects.connector_pose().translation
    assert float(np.linalg.norm(apart)) > 0.05

    world.advance(15.0)
    opened, unplugged, carried, lost, settled = (fault.began_at or 0.0 for fault in world.faults)
    assert 0.0 < unplugged < carried <= opened
    assert 0.2 <= lost - opened < 1.0
    assert settled - lost >= 1.0
    world.close()


@pytest.mark.parametrize(("share", "slips"), [(0.02, True), (0.7, False)])
def test_a_weak_jaw_lets_the_plug_slip_when_it_is_drawn(cell: CableCell, share: float, slips: bool) -> None:
    world = with_fault(cell, JawWeakens(type="jaw_weakens", when=at(0.0), force_share=share))
    take_hold(world)
    draw(world, -0.05 * world.objects.connector_pose().rotation.apply([1.0, 0.0, 0.0]), 1.5)
    assert world.objects.socket.holds == slips
    world.close()


def test_a_knock_moves_a_plugged_connector_not_and_a_loose_one_away(cell: CableCell) -> None:
    world = with_fault(cell, ConnectorKnocked(type="connector_knocked", when=at(2.0), impulse=(0.0, 0.0, 0.02)))
    unplug(world)
    world.advance(1.99)
    before = float(world.objects.connector_velocity()[2])
    world.advance(0.04)
    gained = float(world.objects.connector_velocity()[2]) - before
    # 0.8 m/s for the connector alone; the cable's last links come with it
    assert 0.2 < gained < 0.8
    world.close()


def test_a_snag_pulls_the_cable_back_to_where_it_caught(cell: CableCell) -> None:
    ends = []
    for stiffness in (0.001, 200.0):
        snags = CableSnags(type="cable_snags", when=at(ON), along=0.5, stiffness=stiffness, max_force=20.0)
        world = with_fault(cell, snags)
        link = 10
        world.advance(ON + 0.05)
        state = p.getLinkState(world.objects.cable.body, link, physicsClientId=world.client)[0]
        unplug(world)
        world.advance(1.5)
        now = p.getLinkState(world.objects.cable.body, link, physicsClientId=world.client)[0]
        ends.append(float(np.linalg.norm(np.subtract(now, state))))
        world.close()
    assert ends[1] < 0.02 < ends[0]
