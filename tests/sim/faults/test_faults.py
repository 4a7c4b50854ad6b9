"""When faults begin and end. What they do is in test_fault_effects."""

import numpy as np
import pytest
from hand import draw, start_to_draw, take_hold

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.cable.fault import CableWhen
from regrasp.interfaces.fault import Fault, JawOpens, PlanningFindsNothing, When
from regrasp.interfaces.scene import SceneSetup
from regrasp.sim.faults.effects import Effect
from regrasp.sim.faults.faults import ScheduledFault, TriggerState
from regrasp.sim.world import World

SHARE = 0.02  # of the way, late: contacts are looked at every 8 ms
OPEN_FOR = 1.0  # s


def opens(seconds: float | None = OPEN_FOR, **when: object) -> JawOpens:
    return JawOpens(type="jaw_opens", when=CableWhen.model_validate(when), seconds=seconds)


@pytest.mark.parametrize(
    ("when", "moments", "come"),
    [
        ({"at": (2.0, 2.0)}, TriggerState(1.99), False),
        ({"at": (2.0, 2.0)}, TriggerState(2.0), True),
        ({"carried": (0.5, 0.5)}, TriggerState(shares={"carried": 0.49}), False),
        ({"carried": (0.5, 0.5)}, TriggerState(shares={"carried": 0.51}), True),
        ({"carried": (0.0, 0.0)}, TriggerState(shares={"carried": None}), False),
        ({"phase": "lost"}, TriggerState(phases={"carried": 1.0}), False),
        ({"phase": "lost"}, TriggerState(phases={"carried": 1.0, "lost": 3.0}), True),
        ({"node": "carry"}, TriggerState(nodes={"root/bring/carry": 0.0}), True),
        ({"node": "bring/carry"}, TriggerState(nodes={"root/bring/carry": 0.0}), True),
        ({"node": "root/bring/carry"}, TriggerState(nodes={"root/bring/carry": 0.0}), True),
        ({"node": "arry"}, TriggerState(nodes={"root/bring/carry": 0.0}), False),
        ({"node": "carry", "after": (1.0, 1.0)}, TriggerState(3.9, nodes={"root/carry": 3.0}), False),
        ({"node": "carry", "after": (1.0, 1.0)}, TriggerState(4.0, nodes={"root/carry": 3.0}), True),
    ],
)
def test_a_moment_comes(when: dict[str, object], moments: TriggerState, come: bool) -> None:
    assert moments.triggers(CableWhen.model_validate(when)) == come


@pytest.mark.parametrize(("seconds", "ended"), [(1.0, 3.0), (None, None)])
def test_it_begins_once_and_lasts_so_long(seconds: float | None, ended: float | None) -> None:
    switched: list[str] = []
    fault = ScheduledFault(
        opens(seconds, at=(2.0, 2.0)), Effect(lambda: switched.append("on"), lambda: switched.append("off"))
    )
    active = []
    for now in np.arange(0.0, 5.0, 0.5):
        fault.watch(TriggerState(float(now)))
        active.append(fault.active)
    assert (fault.began_at, fault.ended_at) == (2.0, ended)
    assert switched == (["on", "off"] if seconds else ["on"])
    assert active[:6] == [False] * 4 + [True] * 2
    assert active[6:] == [not seconds] * 4


def share_of_way(world: World, start: FloatArray, way: FloatArray) -> float:
    return float((world.connector_pose().translation - start) @ way) / float(way @ way)


def test_phases_begin_faults_and_the_connector_is_really_lost(cell: CableCell) -> None:
    noted = [
        PlanningFindsNothing(type="planning_finds_nothing", when=When(phase=phase))
        for phase in ("unplugged", "carried", "lost", "settled")
    ]
    faults: tuple[Fault, ...] = (opens(carried=(0.5, 0.5)), *noted)
    world = World(cell, "zero", seed=3, setup=SceneSetup(faults=faults), renderer="software")
    hand, start = world.arms["right"], world.connector_pose().translation
    way = cell.known.cable.clip.world_from_seat.translation - start
    take_hold(world)
    draw(world, -0.06 * world.connector_pose().rotation.apply([1.0, 0.0, 0.0]), 1.5)
    draw(world, 0.25 * way, 1.5)
    assert [fault.waiting for fault in world.faults] == [True, False, True, True, True]
    assert all(world.pads_touching("right"))

    start_to_draw(world, (0.9 - share_of_way(world, start, way)) * way, 1.5)
    while world.faults[0].waiting and hand.is_moving():
        world.advance(0.01)
    assert share_of_way(world, start, way) == pytest.approx(0.5, abs=SHARE)

    world.advance(OPEN_FOR - 0.05)
    assert hand.gripper.true_gap() > 0.05
    world.advance(1.0)
    assert hand.gripper.true_gap() < 0.006  # closed again, on nothing
    assert world.pads_touching("right") == (False, False)
    apart = hand.tool_pose().translation - world.connector_pose().translation
    assert float(np.linalg.norm(apart)) > 0.05

    world.advance(15.0)
    opened, unplugged, carried, lost, settled = (fault.began_at or 0.0 for fault in world.faults)
    assert 0.0 < unplugged < carried <= opened
    assert 0.2 <= lost - opened < 1.0
    assert settled - lost >= 1.0
    world.close()


def test_a_node_begins_a_fault_when_the_world_is_told_of_it(cell: CableCell) -> None:
    world = World(
        cell, "zero", seed=3, setup=SceneSetup(faults=(opens(node="grip", after=(0.1, 0.1)),)), renderer="software"
    )
    world.advance(0.5)
    world.note_entered("root/work/grip")
    world.note_entered("root/work/grip")
    world.advance(0.08)
    assert world.faults[0].waiting
    world.advance(0.05)
    assert world.faults[0].began_at == pytest.approx(0.6, abs=0.01)
    world.close()
