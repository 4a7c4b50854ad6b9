"""Motions at the printer, in its world."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import structlog

from regrasp.app.scenario.load import load_scenario
from regrasp.app.tasks.printer.services import printer_services
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.printer.cell import PrinterCell
from regrasp.interfaces.request import Request
from regrasp.motion.failure import PlanningError
from regrasp.motion.printer.service import PrinterMotion
from regrasp.motion.robots.contact_guard import Touch
from regrasp.sim.printer.objects import PrinterObjects
from regrasp.sim.world import World

ARM, TICK = "arm", 0.05


@dataclass
class Rig:
    world: World[PrinterObjects]
    motion: PrinterMotion

    def run(self, request: Request[Any], seconds: float = 30.0) -> Any:
        end = self.world.now() + seconds
        while not request.poll():
            assert self.world.now() < end, "the request does not end"
            self.world.advance(TICK)
        return request.answer


@pytest.fixture
def rig() -> Iterator[Rig]:
    cell = load_scenario("printer_door").cell
    assert isinstance(cell, PrinterCell)
    world = World(cell, "zero", 3, PrinterObjects(cell))
    services = printer_services(world, 3, structlog.get_logger())
    assert isinstance(services.motion, PrinterMotion)
    yield Rig(world, services.motion)
    world.close()


def test_the_rail_alone_moves_and_only_as_far_as_it_goes(rig: Rig) -> None:
    before = rig.motion.joints(ARM)
    rig.run(rig.motion.move_rail(ARM, 2.0))
    after = rig.motion.joints(ARM)
    assert after[0] == pytest.approx(2.0, abs=2e-3)
    assert after[1:] == pytest.approx(before[1:], abs=5e-3)
    with pytest.raises(PlanningError, match=r"the rail goes from 0 to 3.2 m, asked for 4.000 m") as caught:
        rig.run(rig.motion.move_rail(ARM, 4.0))
    assert caught.value.code is CauseCode.OUT_OF_REACH
    with pytest.raises(ValueError, match="not finite"):
        rig.motion.move_rail(ARM, float("nan"))


def test_the_arm_keeps_clear_of_the_door_where_it_stands(rig: Rig) -> None:
    motion = rig.motion
    before_open = motion.handle(0.43)
    q = motion.kinematics[ARM].ik(before_open)[0]
    assert motion.model(ARM).nearest(q)[1] != "door_handle"
    motion.believe_door(0.43)
    assert motion.model(ARM).nearest(q)[1] == "door_handle"


def test_a_place_that_was_felt_and_bars_a_straight_line_is_forgotten(rig: Rig) -> None:
    """A guard may have mistaken a jerk for a touch. If something is there, it is felt again."""
    motion, down = rig.motion, np.array([0.0, 0.0, -0.1])
    rig.run(motion.shift(ARM, down))
    below = motion.joints(ARM)
    rig.run(motion.shift(ARM, -down))
    efforts = np.array([0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0])
    motion.feel(ARM, Touch(rig.world.now(), below, 10.0 * (below - motion.joints(ARM)), efforts))
    before = motion.tool(ARM).translation
    rig.run(motion.shift(ARM, down))
    assert motion.tool(ARM).translation - before == pytest.approx(down, abs=3e-3)
    assert not motion.forget_felt()


def test_a_hand_that_takes_the_handle_gives_way_to_it_and_the_door_goes_along(rig: Rig) -> None:
    motion = rig.motion
    rig.run(motion.release(ARM, 0.045))
    rig.run(motion.move_rail(ARM, 1.768))
    rig.run(motion.reach(ARM, motion.handle(0.0), 0.08, ["door_handle"]))
    assert rig.run(motion.take_handle(ARM)) == pytest.approx(0.02, abs=2e-3)
    assert abs(motion._force_on(ARM)[1]) < motion.parameters.relieved
    rig.run(motion.slide_door(ARM, float(motion.joints(ARM)[0]) + 0.1))
    assert motion.door_opening == pytest.approx(0.1, abs=3e-3)
    assert rig.world.objects.door.opening == pytest.approx(0.1, abs=4e-3)
    peaks = {pair: force for pair, force in rig.world.contact_peaks.items() if force > 1.0}
    assert peaks == {}
    assert np.all(np.isfinite(motion.joints(ARM)))
