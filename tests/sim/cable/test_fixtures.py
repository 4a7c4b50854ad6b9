"""The socket and the clip on a free connector without gravity."""

import numpy as np
import pytest
from free_plug import FreePlug, free_plug
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cable.cell import CableCell
from regrasp.sim.cable.fixtures import ClipHold, ClipParameters
from regrasp.sim.cable.objects import CableObjectsParameters
from regrasp.sim.hold import Catch, Hold

STAND_FORCE = CableObjectsParameters().stand_force
RAMP = 2.0  # N/s
LET_GO = 1.0  # N around the stated force
SEATED = 0.0005  # m


@pytest.fixture
def plug(cell: CableCell, client: int) -> FreePlug:
    return free_plug(cell, client)


@pytest.fixture
def clip(cell: CableCell, plug: FreePlug) -> ClipHold:
    mass, length, radius = (
        cell.hidden.cable.connector_mass,
        cell.known.cable.connector.length,
        cell.known.cable.connector.radius,
    )
    across = mass * (3 * radius**2 + length**2) / 12
    return ClipHold(plug.link, cell.known.cable.clip, mass, across, plug.step)


def near_seat(cell: CableCell, distance: float, angle_deg: float) -> RigidTransform:
    """A pose so far from the clip's seat, in a slanted direction."""
    seat = cell.known.cable.clip.world_from_seat
    offset = distance * np.array([2.0, -1.0, 2.0]) / 3.0
    tilt = Rotation.from_euler("y", angle_deg, degrees=True)
    return RigidTransform.from_components(seat.translation + offset, seat.rotation * tilt)


def seated(cell: CableCell, plug: FreePlug, clip: ClipHold) -> None:
    plug.put(cell.known.cable.clip.world_from_seat)
    plug.advance(0.5, clip)
    assert clip.holds


@pytest.mark.parametrize(
    ("distance", "angle_deg", "caught"),
    [
        (0.0, 0.0, True),
        (0.019, 0.0, True),
        (0.0, 19.0, True),
        (0.019, 19.0, True),
        (0.021, 0.0, False),
        (0.0, 21.0, False),
        (0.0, 180.0, False),
    ],
)
def test_it_takes_an_end_that_rests_in_its_mouth(
    cell: CableCell, plug: FreePlug, clip: ClipHold, distance: float, angle_deg: float, caught: bool
) -> None:
    plug.put(near_seat(cell, distance, angle_deg))
    plug.advance(1.5, clip)
    assert clip.holds == caught
    if caught:
        off = cell.known.cable.clip.world_from_seat.inv() * plug.state().pose
        assert float(np.linalg.norm(off.translation)) < SEATED
        assert float(off.rotation.apply([1, 0, 0])[0]) > np.cos(np.deg2rad(1.0))


@pytest.mark.parametrize("speed", [0.03, 0.5])
def test_it_does_not_take_a_passing_end(cell: CableCell, plug: FreePlug, clip: ClipHold, speed: float) -> None:
    plug.put(near_seat(cell, 0.04, 0.0), -speed * np.array([2.0, -1.0, 2.0]) / 3.0)
    closest = np.inf
    for _ in range(round(0.1 / speed / 0.01)):
        plug.advance(0.01, clip)
        off = plug.state().pose.translation - cell.known.cable.clip.world_from_seat.translation
        closest = min(closest, float(np.linalg.norm(off)))
        assert not clip.holds
    assert closest < 0.01  # m: it did pass through the mouth


def test_it_does_not_take_an_end_that_rests_for_too_short_a_time(
    cell: CableCell, plug: FreePlug, clip: ClipHold
) -> None:
    plug.put(near_seat(cell, 0.005, 0.0))
    plug.advance(0.15, clip)
    assert not clip.holds


DIRECTIONS = [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.6, -0.8)]


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_it_holds_ten_newtons(
    cell: CableCell, plug: FreePlug, clip: ClipHold, direction: tuple[float, float, float]
) -> None:
    seated(cell, plug, clip)
    plug.advance(3.0, clip, 10.0 * np.asarray(direction))
    off = plug.state().pose.translation - cell.known.cable.clip.world_from_seat.translation
    assert clip.holds
    np.testing.assert_allclose(
        off, 10.0 / cell.known.cable.clip.hold_force * ClipParameters().lip_travel * np.asarray(direction), atol=2e-4
    )


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_it_lets_go_above_its_force(
    cell: CableCell, plug: FreePlug, clip: ClipHold, direction: tuple[float, float, float]
) -> None:
    seated(cell, plug, clip)
    force = 10.0
    while clip.holds and force < 30.0:
        force += RAMP * 0.01
        plug.advance(0.01, clip, force * np.asarray(direction))
    assert force == pytest.approx(cell.known.cable.clip.hold_force, abs=LET_GO)


def test_what_was_pulled_out_is_taken_again_only_after_it_left(cell: CableCell, plug: FreePlug, clip: ClipHold) -> None:
    seated(cell, plug, clip)
    plug.put(near_seat(cell, 0.021, 0.0))
    plug.advance(0.01, clip)
    assert not clip.holds
    plug.put(near_seat(cell, 0.01, 0.0))
    plug.advance(0.5, clip)
    assert not clip.holds
    plug.put(near_seat(cell, 0.04, 0.0))
    plug.advance(0.01, clip)
    plug.put(near_seat(cell, 0.01, 0.0))
    plug.advance(0.5, clip)
    assert clip.holds


@pytest.mark.parametrize(("force", "stays"), [(5.0, True), (9.5, True), (10.5, False), (15.0, False)])
def test_a_socket_lets_go_at_its_pull_out_force(plug: FreePlug, force: float, stays: bool) -> None:
    socket = Catch(Hold(plug.link, RigidTransform.identity()), np.array([0.0, 1.0, 0.0]), 10.0)
    for _ in range(480):
        plug.advance(plug.step, force=np.array([0.0, -force, 0.0]))
        socket.step()
    moved = float(np.linalg.norm(plug.state().pose.translation))
    assert socket.holds == stays
    assert (moved < 1e-4) == stays  # m


def test_a_single_steps_spike_does_not_unplug(plug: FreePlug) -> None:
    socket = Catch(Hold(plug.link, RigidTransform.identity()), np.array([0.0, 1.0, 0.0]), 10.0)
    for i in range(100):
        plug.advance(plug.step, force=np.array([40.0 if i == 50 else 0.0, 0.0, 0.0]))
        socket.step()
    assert socket.holds


@pytest.mark.parametrize("direction", [*DIRECTIONS, (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)])
@pytest.mark.parametrize(("share", "stays"), [(0.95, True), (1.05, False)])
def test_a_stand_lets_go_at_its_force_whichever_way(
    plug: FreePlug, direction: tuple[float, float, float], share: float, stays: bool
) -> None:
    stand = Catch(Hold(plug.link, RigidTransform.identity()), None, STAND_FORCE)
    for _ in range(480):
        plug.advance(plug.step, force=share * STAND_FORCE * np.asarray(direction))
        stand.step()
    assert stand.holds == stays
    assert (float(np.linalg.norm(plug.state().pose.translation)) < 1e-4) == stays  # m
