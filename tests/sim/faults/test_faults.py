"""When faults begin and end. What they do is in test_fault_effects."""

from typing import ClassVar

import numpy as np
import pytest

from regrasp.interfaces.cell import Cell
from regrasp.interfaces.fault import FractionRange, JawOpens, When
from regrasp.interfaces.scene import SceneSetup
from regrasp.sim.faults.effects import Effect
from regrasp.sim.faults.faults import ScheduledFault, TriggerState
from regrasp.sim.objects import NoObjects
from regrasp.sim.world import World

OPEN_FOR = 1.0  # s


class PrintWhen(When):
    """Of a task with a share of progress, and phases."""

    SHARES: ClassVar[tuple[str, ...]] = ("printed",)
    printed: FractionRange | None = None
    phase: str | None = None


def opens(seconds: float | None = OPEN_FOR, **when: object) -> JawOpens:
    return JawOpens(type="jaw_opens", when=PrintWhen.model_validate(when), seconds=seconds)


@pytest.mark.parametrize(
    ("when", "moments", "come"),
    [
        ({"at": (2.0, 2.0)}, TriggerState(1.99), False),
        ({"at": (2.0, 2.0)}, TriggerState(2.0), True),
        ({"printed": (0.5, 0.5)}, TriggerState(shares={"printed": 0.49}), False),
        ({"printed": (0.5, 0.5)}, TriggerState(shares={"printed": 0.51}), True),
        ({"printed": (0.0, 0.0)}, TriggerState(shares={"printed": None}), False),
        ({"phase": "lost"}, TriggerState(phases={"begun": 1.0}), False),
        ({"phase": "lost"}, TriggerState(phases={"begun": 1.0, "lost": 3.0}), True),
        ({"node": "carry"}, TriggerState(nodes={"root/bring/carry": 0.0}), True),
        ({"node": "bring/carry"}, TriggerState(nodes={"root/bring/carry": 0.0}), True),
        ({"node": "root/bring/carry"}, TriggerState(nodes={"root/bring/carry": 0.0}), True),
        ({"node": "arry"}, TriggerState(nodes={"root/bring/carry": 0.0}), False),
        ({"node": "carry", "after": (1.0, 1.0)}, TriggerState(3.9, nodes={"root/carry": 3.0}), False),
        ({"node": "carry", "after": (1.0, 1.0)}, TriggerState(4.0, nodes={"root/carry": 3.0}), True),
    ],
)
def test_a_moment_comes(when: dict[str, object], moments: TriggerState, come: bool) -> None:
    assert moments.triggers(PrintWhen.model_validate(when)) == come


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


def test_a_node_begins_a_fault_when_the_world_is_told_of_it(cell: Cell) -> None:
    world = World(cell, "zero", 3, NoObjects(), SceneSetup(faults=(opens(node="grip", after=(0.1, 0.1)),)))
    world.advance(0.5)
    world.note_entered("root/work/grip")
    world.note_entered("root/work/grip")
    world.advance(0.08)
    assert world.faults[0].waiting
    world.advance(0.05)
    assert world.faults[0].began_at == pytest.approx(0.6, abs=0.01)
    world.close()
