"""The door against theory: dry friction on a slide, and its ends."""

from collections.abc import Iterator

import pybullet as p
import pytest

from regrasp.app.scenario.load import load_scenario
from regrasp.interfaces.printer.cell import PrinterCell
from regrasp.interfaces.scene import Gravity
from regrasp.sim.engine import Engine
from regrasp.sim.printer.door import SimDoor

HANDLE = 1  # the handle's link


@pytest.fixture(params=["zero", "earth"])
def engine(request: pytest.FixtureRequest) -> Iterator[Engine]:
    gravity: Gravity = request.param
    made = Engine(cell().hidden, gravity)
    yield made
    made.close()


def cell() -> PrinterCell:
    found = load_scenario("printer_door").cell
    assert isinstance(found, PrinterCell)
    return found


def pulled(engine: Engine, door: SimDoor, force: float, seconds: float) -> float:
    """How far, m, the door goes while a force (N) pulls at its handle along y."""
    before = door.opening
    for _ in range(round(seconds * engine.step_rate)):
        at = p.getLinkState(door.body, HANDLE, physicsClientId=engine.client)[0]
        p.applyExternalForce(door.body, HANDLE, [0.0, force, 0.0], at, p.WORLD_FRAME, physicsClientId=engine.client)
        engine.step()
    return door.opening - before


def test_friction_holds_the_door_and_slows_it_as_coulomb_says(engine: Engine) -> None:
    hidden = cell().hidden.printer
    door = SimDoor(engine.client, cell().known.printer.door, hidden)
    assert pulled(engine, door, 0.95 * hidden.door_friction, 0.5) == pytest.approx(0.0, abs=1e-6)
    assert pulled(engine, door, -20.0, 0.5) == pytest.approx(0.0, abs=1e-3)  # the closed end
    # s = (F - R) t^2 / 2 m, then it slides on until friction has taken its energy: s (F - R) / R
    force, seconds = hidden.door_friction + 2.0, 0.3
    way = 0.5 * 2.0 / hidden.door_mass * seconds**2
    went = pulled(engine, door, force, seconds)
    speed, step = 2.0 / hidden.door_mass * seconds, engine.step_seconds  # the engine moves with a step's new speed
    assert went == pytest.approx(way + 0.5 * speed * step, rel=0.01)
    slid = way * 2.0 / hidden.door_friction - 0.5 * speed * step
    assert pulled(engine, door, 0.0, 1.0) == pytest.approx(slid, rel=0.01)
    assert pulled(engine, door, 0.0, 1.0) == pytest.approx(0.0, abs=1e-6)


def test_the_door_ends_where_its_travel_does(engine: Engine) -> None:
    spec = cell().known.printer.door
    door = SimDoor(engine.client, spec, cell().hidden.printer)
    pulled(engine, door, 20.0, 1.5)
    assert door.opening == pytest.approx(spec.travel, abs=2e-3)
    handle = p.getLinkState(door.body, HANDLE, physicsClientId=engine.client)[0]
    assert handle == pytest.approx(spec.parts(door.opening)[1].center, abs=1e-5)


def test_a_handle_that_is_shifted_stays_there_and_the_door_goes_with_it(engine: Engine) -> None:
    spec = cell().known.printer.door
    door = SimDoor(engine.client, spec, cell().hidden.printer)
    for step in range(100):
        door.shift_handle(2e-4 * (step + 1))
        engine.step()
    assert door.opening == pytest.approx(0.0, abs=1e-3)  # friction holds the door
    pulled(engine, door, 15.0, 0.3)
    assert door.opening > 0.02
    x, y, z = spec.parts(door.opening)[1].center
    handle = p.getLinkState(door.body, HANDLE, computeForwardKinematics=1, physicsClientId=engine.client)[0]
    assert handle == pytest.approx((x, y + 0.02, z), abs=1e-4)
