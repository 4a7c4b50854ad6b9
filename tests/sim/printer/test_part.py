"""The part, its plate and the clamp against theory: what breaks the bond, what frees the plate, free flight."""

from collections.abc import Iterator

import numpy as np
import pybullet as p
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.app.scenario.load import load_scenario
from regrasp.interfaces.printer.cell import PrinterCell
from regrasp.interfaces.scene import EARTH_GRAVITY
from regrasp.sim.bodies import BodyLink
from regrasp.sim.engine import Engine
from regrasp.sim.hold import Hold
from regrasp.sim.printer.clamp import SimClamp
from regrasp.sim.printer.part import SimPart

TURN = Rotation.from_euler("zyx", [40.0, -25.0, 70.0], degrees=True)


@pytest.fixture
def cell() -> PrinterCell:
    found = load_scenario("printer_door").cell
    assert isinstance(found, PrinterCell)
    return found


@pytest.fixture
def engine(cell: PrinterCell) -> Iterator[Engine]:
    made = Engine(cell.hidden, "zero")
    yield made
    made.close()


@pytest.fixture
def part(cell: PrinterCell, engine: Engine) -> SimPart:
    return SimPart(engine, cell.known.printer, cell.hidden.printer)


def turned_and_fixed(engine: Engine, part: SimPart) -> None:
    """Part and plate, turned together, and the plate fixed to the world there."""
    part.catch.release()
    about = part.pose(part.plate)
    for body in (part.plate, part.part):
        offset = about.inv() * part.pose(body)
        at = RigidTransform.from_components(about.translation, TURN) * offset
        p.resetBasePositionAndOrientation(
            body, at.translation.tolist(), at.rotation.as_quat().tolist(), physicsClientId=engine.client
        )
    Hold(BodyLink(engine.client, part.plate), RigidTransform.from_components(about.translation, TURN))


def loaded(
    engine: Engine,
    part: SimPart,
    body: int,
    force: object,
    torque: object = (0.0, 0.0, 0.0),
    at: object = None,
    seconds: float = 0.1,
) -> None:
    """A force (3,) N at a point, by default the body's middle, and a torque (3,) N m for a while, both of the world."""
    for _ in range(round(seconds * engine.step_rate)):
        place = part.pose(body).translation if at is None else np.asarray(at)
        p.applyExternalForce(body, -1, list(force), place.tolist(), p.WORLD_FRAME, physicsClientId=engine.client)  # type: ignore[call-overload]
        p.applyExternalTorque(body, -1, list(torque), p.WORLD_FRAME, physicsClientId=engine.client)  # type: ignore[call-overload]
        engine.step()
        part.step()


@pytest.mark.parametrize(("share", "stays"), [(0.95, True), (1.05, False)])
@pytest.mark.parametrize("load", ["shear x", "shear y", "shear xy", "normal", "tilt x", "tilt y", "twist", "untwist"])
def test_the_bond_breaks_at_its_stated_forces_and_torques(
    cell: PrinterCell, engine: Engine, part: SimPart, load: str, share: float, stays: bool
) -> None:
    """The part is turned with its plate, and pulled in the middle of its foot."""
    turned_and_fixed(engine, part)
    kind, _, axis = load.partition(" ")
    limit = getattr(cell.hidden.printer.bond, kind.removeprefix("un"))
    way = {"x": [1.0, 0.0, 0.0], "y": [0.0, 1.0, 0.0], "xy": [0.6, -0.8, 0.0], "": [0.0, 0.0, 1.0]}[axis]
    vector = TURN.apply(share * limit * np.array(way)) * (-1.0 if kind == "untwist" else 1.0)
    foot = part.pose(part.part).apply([0.0, 0.0, -0.5 * cell.known.printer.part.size[2]])
    if kind in ("shear", "normal"):
        loaded(engine, part, part.part, vector, at=foot)
    else:
        loaded(engine, part, part.part, np.zeros(3), vector)
    assert part.bond.holds == stays


def test_pressing_breaks_nothing_and_a_push_at_the_top_tilts(cell: PrinterCell, engine: Engine, part: SimPart) -> None:
    turned_and_fixed(engine, part)
    bond, height = cell.hidden.printer.bond, cell.known.printer.part.size[2]
    loaded(engine, part, part.part, TURN.apply([0.0, 0.0, -3.0 * bond.normal]))
    assert part.bond.holds
    top = part.pose(part.part).apply([0.0, 0.0, 0.5 * height])
    push = bond.tilt / height  # N at the top that makes the tilt that it bears; less than the shear that it bears
    assert push < bond.shear
    loaded(engine, part, part.part, TURN.apply([0.95 * push, 0.0, 0.0]), at=top)
    assert part.bond.holds
    loaded(engine, part, part.part, TURN.apply([1.05 * push, 0.0, 0.0]), at=top)
    assert not part.bond.holds


@pytest.mark.parametrize(
    ("force", "stays"),
    [((5.7, 0.0, 0.0), True), ((6.3, 0.0, 0.0), False), ((-20.0, 0.0, 0.0), True), ((0.0, 20.0, 15.0), True)],
)
def test_the_catch_lets_the_plate_go_out_above_its_force_and_no_other_way(
    engine: Engine, part: SimPart, force: tuple[float, float, float], stays: bool
) -> None:
    before = part.pose(part.plate).translation
    loaded(engine, part, part.part, force, at=part.pose(part.plate).translation)
    assert part.catch.holds == stays
    assert part.bond.holds
    assert (float(np.abs(part.pose(part.plate).translation - before).max()) < 1e-4) == stays  # m


def test_what_was_drawn_out_floats_on_for_ever(engine: Engine, part: SimPart) -> None:
    """No force, no change: the common centre of part and plate goes straight, and no energy is gained or lost."""
    part.catch.release()
    client, bodies = engine.client, (part.plate, part.part)
    for body in bodies:  # as one body that goes along x and does not turn
        p.resetBaseVelocity(body, [0.05, 0.01, 0.02], [0.0, 0.0, 0.0], physicsClientId=client)
    before = [part.pose(body).translation for body in bodies]
    for _ in range(10 * engine.step_rate):
        engine.step()
        part.step()
    for body, start in zip(bodies, before, strict=True):
        went = part.pose(body).translation - start
        np.testing.assert_allclose(went, [0.5, 0.1, 0.2], atol=2e-3)
    assert part.bond.holds


def test_a_part_that_broke_off_drifts_and_tumbles_without_gaining_energy(
    cell: PrinterCell, engine: Engine, part: SimPart
) -> None:
    turned_and_fixed(engine, part)
    loaded(engine, part, part.part, TURN.apply([0.0, 0.0, 2.0 * cell.hidden.printer.bond.normal]), seconds=0.02)
    assert not part.bond.holds
    client, body = engine.client, part.part
    away = RigidTransform.from_translation([1.5, 0.0, 0.5]) * part.pose(body)
    p.resetBasePositionAndOrientation(
        body, away.translation.tolist(), away.rotation.as_quat().tolist(), physicsClientId=client
    )
    p.resetBaseVelocity(body, [0.02, 0.0, 0.01], [0.3, 0.5, 0.2], physicsClientId=client)
    engine.step()
    before, energies = energy(client, body), []
    for _ in range(20 * engine.step_rate):
        engine.step()
        part.step()
        energies.append(energy(client, body))
    assert max(energies) < 1.02 * before
    assert not p.getContactPoints(body, physicsClientId=client)


def energy(client: int, body: int) -> float:
    """Kinetic energy of a body with one link, J."""
    link = p.getLinkState(body, 0, computeLinkVelocity=1, physicsClientId=client)
    turn = p.getBasePositionAndOrientation(body, physicsClientId=client)[1]
    moving = [(-1, turn, *p.getBaseVelocity(body, physicsClientId=client)), (0, link[1], link[6], link[7])]
    total = 0.0
    for index, quaternion, velocity, rate in moving:
        mass, _, inertia = p.getDynamicsInfo(body, index, physicsClientId=client)[:3]
        local = Rotation.from_quat(quaternion).inv().apply(rate)
        total += 0.5 * mass * float(np.square(velocity).sum()) + 0.5 * float(np.array(inertia) @ local**2)
    return total


def test_plate_and_part_fall_as_one(cell: PrinterCell) -> None:
    """On Earth, out in the room: s = g t (t + dt) / 2 in steps of dt, and the bond bears nothing."""
    engine = Engine(cell.hidden, "earth")
    part = SimPart(engine, cell.known.printer, cell.hidden.printer)
    part.catch.release()
    start, seconds = part.pose(part.part).translation, 0.4
    for _ in range(round(seconds * engine.step_rate)):
        engine.step()
        part.step()
    fell = start[2] - part.pose(part.part).translation[2]
    assert fell == pytest.approx(0.5 * EARTH_GRAVITY * seconds * (seconds + engine.step_seconds), rel=0.002)
    assert part.bond.holds
    engine.close()


@pytest.mark.parametrize(("share", "stays"), [(0.9, True), (1.1, False)])
def test_the_clamp_holds_a_plate_by_friction_alone(
    cell: PrinterCell, engine: Engine, part: SimPart, share: float, stays: bool
) -> None:
    """Two faces of friction: F = 2 mu N."""
    hidden, client = cell.hidden.printer, engine.client
    part.catch.release()
    clamp = SimClamp(client, cell.known.printer, hidden, part.plate)
    way = np.array(cell.known.printer.clamp.center) - part.pose(part.plate).translation
    for body in (part.plate, part.part):
        at = (part.pose(body).translation + way).tolist()
        p.resetBasePositionAndOrientation(body, at, [0, 0, 0, 1], physicsClientId=client)
    clamp.close()
    loaded(engine, part, part.plate, (0.0, 0.0, 0.0), seconds=1.5)
    stroke = cell.known.printer.clamp.stroke
    assert clamp.travel() == pytest.approx((stroke, stroke), abs=1e-3)
    before = part.pose(part.plate).translation
    most = 2.0 * hidden.plate_friction * hidden.clamp_force
    loaded(engine, part, part.plate, (share * most, 0.0, 0.0), seconds=0.5)
    went = float(np.linalg.norm(part.pose(part.plate).translation - before))
    assert (went < 1e-3) == stays  # m


def test_an_open_clamp_leaves_the_plate_alone(cell: PrinterCell, engine: Engine, part: SimPart) -> None:
    clamp = SimClamp(engine.client, cell.known.printer, cell.hidden.printer, part.plate)
    spec, plate = cell.known.printer.clamp, cell.known.printer.plate
    for jaw, side in zip(clamp.jaws, (1.0, -1.0), strict=True):
        at = p.getLinkState(clamp.body, jaw, physicsClientId=engine.client)[0]
        face = side * (at[1] - spec.center[1]) + 0.5 * spec.jaw_size[1]
        assert -face - 0.5 * plate.size[1] == pytest.approx(spec.stroke, abs=1e-6)


def test_the_clamp_brings_a_plate_to_its_middle_and_holds_it_there(
    cell: PrinterCell, engine: Engine, part: SimPart
) -> None:
    part.catch.release()
    part.bond.release()
    clamp, middle = (
        SimClamp(engine.client, cell.known.printer, cell.hidden.printer, part.plate),
        cell.known.printer.clamp.center,
    )
    beside = [middle[0], middle[1] + 0.006, middle[2]]
    p.resetBasePositionAndOrientation(part.plate, beside, [0, 0, 0, 1], physicsClientId=engine.client)
    p.resetBasePositionAndOrientation(part.part, [0, 0, 3], [0, 0, 0, 1], physicsClientId=engine.client)
    clamp.close()
    for _ in range(10 * engine.step_rate):
        engine.step()
    assert part.pose(part.plate).translation == pytest.approx(middle, abs=5e-4)
    assert clamp.presses(part.plate)


@pytest.fixture
def clamped(cell: PrinterCell, engine: Engine, part: SimPart) -> SimClamp:
    """The clamp, closed on the plate with the part on it, long enough to come to rest."""
    part.catch.release()
    clamp = SimClamp(engine.client, cell.known.printer, cell.hidden.printer, part.plate)
    way = np.array(cell.known.printer.clamp.center) - part.pose(part.plate).translation
    for body in (part.plate, part.part):
        at = (part.pose(body).translation + way).tolist()
        p.resetBasePositionAndOrientation(body, at, [0, 0, 0, 1], physicsClientId=engine.client)
    for _ in range(3 * engine.step_rate):  # open, and at rest
        engine.step()
    clamp.close()
    loaded(engine, part, part.plate, (0.0, 0.0, 0.0), seconds=5.0)
    assert clamp.travel() == pytest.approx(2 * (cell.known.printer.clamp.stroke,), abs=1e-3)
    return clamp


@pytest.mark.parametrize(("share", "stays"), [(0.9, True), (1.1, False)])
def test_a_part_on_a_plate_at_rest_in_the_clamp_comes_off_at_its_load(
    cell: PrinterCell, engine: Engine, part: SimPart, clamped: SimClamp, share: float, stays: bool
) -> None:
    loaded(engine, part, part.part, (0.0, 0.0, 0.0), (0.0, 0.0, share * cell.hidden.printer.bond.twist), seconds=0.5)
    assert part.bond.holds == stays


def test_what_the_clamp_holds_sleeps_until_a_body_touches_it(
    cell: PrinterCell, engine: Engine, part: SimPart, clamped: SimClamp
) -> None:
    part.take_away()
    loaded(engine, part, part.plate, (0.0, 0.0, 0.0), seconds=5.0)
    before = part.pose(part.plate).translation
    bears = 2.0 * cell.hidden.printer.plate_friction * cell.hidden.printer.clamp_force
    loaded(engine, part, part.plate, (2.0 * bears, 0.0, 0.0), seconds=0.2)  # which would draw it out if it were awake
    assert np.array_equal(part.pose(part.plate).translation, before)
    assert clamped.presses(part.plate)
    ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.02, physicsClientId=engine.client)
    start = (before - np.array([0.3, 0.0, 0.0])).tolist()
    thrown = p.createMultiBody(20.0, ball, basePosition=start, physicsClientId=engine.client)
    p.resetBaseVelocity(thrown, [3.0, 0.0, 0.0], physicsClientId=engine.client)
    loaded(engine, part, part.plate, (0.0, 0.0, 0.0), seconds=0.5)
    assert part.pose(part.plate).translation[0] - before[0] > 0.01


def test_a_clamp_at_rest_opens(engine: Engine, part: SimPart, clamped: SimClamp) -> None:
    part.take_away()
    loaded(engine, part, part.plate, (0.0, 0.0, 0.0), seconds=5.0)
    clamped.open()
    loaded(engine, part, part.plate, (0.0, 0.0, 0.0), seconds=3.0)
    assert clamped.travel() == pytest.approx((0.0, 0.0), abs=1e-3)
