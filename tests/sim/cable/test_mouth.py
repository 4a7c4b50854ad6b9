"""A free socket's mouth, on a connector without a cable and without gravity."""

from collections.abc import Callable

import numpy as np
import pybullet as p
import pytest
from free_plug import FreePlug, free_plug
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableCell, Socket
from regrasp.sim.cable.bore import BoreParameters
from regrasp.sim.cable.cable import BodyState
from regrasp.sim.cable.mouth import MouthParameters, SocketMouth

NAME = "back_1"
DRAG = 3.0  # N s/m, of a slow hand
RAMP = 2.0  # N/s
MOUTH, BORE = MouthParameters(), BoreParameters()


@pytest.fixture
def plug(cell: CableCell, client: int) -> FreePlug:
    return free_plug(cell, client)


@pytest.fixture
def socket(cell: CableCell) -> Socket:
    return cell.known.cable.socket(NAME)


@pytest.fixture
def mouth(cell: CableCell, plug: FreePlug, socket: Socket) -> SocketMouth:
    return SocketMouth(plug.link, socket, cell.known.cable.connector)


def seat(cell: CableCell) -> RigidTransform:
    return cell.known.cable.socket(NAME).world_from_plug(cell.known.cable.connector.length)


def before(cell: CableCell, across: float = 0.0, tilt_deg: float = 0.0, gap: float = 0.002) -> RigidTransform:
    """A pose with the tip `gap` m before the mouth and `across` m off its axis, tilted about the tip."""
    deep = cell.known.cable.socket(NAME).depth
    tip = RigidTransform.from_translation([0.5 * cell.known.cable.connector.length, 0.0, 0.0])
    there = RigidTransform.from_translation([-deep - gap, across, 0.0])
    turn = RigidTransform.from_rotation(Rotation.from_euler("z", tilt_deg, degrees=True))
    return seat(cell) * there * tip * turn * tip.inv()


def tip_of(cell: CableCell, plug: FreePlug) -> FloatArray:
    """How deep the tip is in the mouth, and how far off its axis, (3,) m."""
    half, deep = 0.5 * cell.known.cable.connector.length, cell.known.cable.socket(NAME).depth
    tip = seat(cell).inv().apply(plug.state().pose.apply([half, 0.0, 0.0]))
    return np.asarray(tip - [half - deep, 0.0, 0.0])


def pushed(cell: CableCell, force: float) -> Callable[[BodyState], FloatArray]:
    """A push of so many newtons along the way in, by a slow hand."""
    axis = seat(cell).rotation.apply([1.0, 0.0, 0.0])
    return lambda state: np.asarray(force * axis - DRAG * np.array(state.velocity))


def on_rail(plug: FreePlug, pose: RigidTransform, cell: CableCell) -> None:
    """Put it there, where a rigid hand lets it go along the socket's axis only."""
    plug.put(pose)
    along = pose.rotation.inv().apply(seat(cell).rotation.apply([1.0, 0.0, 0.0])).tolist()
    place, turn = pose.translation.tolist(), pose.rotation.as_quat().tolist()
    p.createConstraint(
        plug.body, -1, -1, -1, p.JOINT_PRISMATIC, along, [0, 0, 0], place, [0, 0, 0, 1], turn, plug.client
    )


def test_an_aligned_plug_goes_in_and_clicks(cell: CableCell, plug: FreePlug, mouth: SocketMouth) -> None:
    plug.put(before(cell))
    plug.advance(1.0, mouth, pushed(cell, BORE.insertion_force + 1.0))
    assert mouth.holds
    plug.advance(0.5, mouth)
    assert mouth.holds
    assert tip_of(cell, plug) == pytest.approx([cell.known.cable.socket(NAME).depth, 0.0, 0.0], abs=1.5e-3)


@pytest.mark.parametrize("share", [0.4, 0.8])
def test_friction_grows_on_the_way_in(cell: CableCell, plug: FreePlug, mouth: SocketMouth, share: float) -> None:
    plug.put(before(cell))
    plug.advance(3.0, mouth, pushed(cell, share * BORE.insertion_force))
    assert not mouth.holds
    assert tip_of(cell, plug)[0] == pytest.approx(share * cell.known.cable.socket(NAME).depth, abs=1e-3)
    plug.advance(1.0, mouth)  # it stays
    assert tip_of(cell, plug)[0] == pytest.approx(share * cell.known.cable.socket(NAME).depth, abs=1.5e-3)


@pytest.mark.parametrize("force", [2.0, 6.0, 12.0])
def test_the_face_pushes_back_as_a_spring(cell: CableCell, plug: FreePlug, mouth: SocketMouth, force: float) -> None:
    on_rail(plug, before(cell, across=0.007), cell)
    plug.advance(2.0, mouth, pushed(cell, force))
    assert not mouth.holds
    assert tip_of(cell, plug)[0] == pytest.approx(force / MOUTH.stiffness, rel=0.05)


@pytest.mark.parametrize("across", [0.002, 0.0035])
def test_a_rigid_hand_that_is_off_does_not_get_in(
    cell: CableCell, plug: FreePlug, mouth: SocketMouth, across: float
) -> None:
    on_rail(plug, before(cell, across), cell)
    plug.advance(2.0, mouth, pushed(cell, 6.0))
    assert not mouth.holds
    assert tip_of(cell, plug)[1] == pytest.approx(across, abs=1e-4)
    assert tip_of(cell, plug)[0] < 0.5 * cell.known.cable.socket(NAME).depth


@pytest.mark.parametrize("across", [0.002, 0.0035])
def test_the_chamfer_draws_in_a_plug_that_may_give_way(
    cell: CableCell, plug: FreePlug, mouth: SocketMouth, across: float
) -> None:
    plug.put(before(cell, across))
    plug.advance(2.0, mouth, pushed(cell, 6.0))
    assert mouth.holds
    assert abs(tip_of(cell, plug)[1]) < MOUTH.clearance + MOUTH.give + 1e-3  # pressed on by 6 N at its centre, it tilts


@pytest.mark.parametrize(("tilt_deg", "enters"), [(5.0, True), (10.0, False)])
def test_a_skew_plug_does_not_enter(
    cell: CableCell, plug: FreePlug, mouth: SocketMouth, tilt_deg: float, enters: bool
) -> None:
    on_rail(plug, before(cell, tilt_deg=tilt_deg), cell)
    plug.advance(2.0, mouth, pushed(cell, 6.0))
    assert mouth.holds == enters


def test_it_holds_a_plug_as_a_spring_up_to_its_pull_out_force(
    cell: CableCell, plug: FreePlug, socket: Socket, mouth: SocketMouth
) -> None:
    plug.put(before(cell))
    plug.advance(1.0, mouth, pushed(cell, BORE.insertion_force + 1.0))
    plug.advance(0.5, mouth)
    rest, force, drawn = tip_of(cell, plug)[0], 0.0, 0.0
    while mouth.holds and force < 30.0:
        drawn = rest - tip_of(cell, plug)[0]
        assert drawn == pytest.approx(force / BORE.seat_stiffness, abs=1e-4)
        force += RAMP * 0.05
        plug.advance(0.05, mouth, pushed(cell, -force))
    assert force == pytest.approx(socket.pull_out_force, abs=0.5)


def test_a_plug_that_was_drawn_out_goes_in_again(cell: CableCell, plug: FreePlug, mouth: SocketMouth) -> None:
    bodies = p.getNumBodies(plug.client), p.getNumConstraints(plug.client)
    for _ in range(2):
        plug.put(before(cell))
        held = []
        for force in (BORE.insertion_force + 1.0, -12.0):
            plug.advance(1.0, mouth, pushed(cell, force))
            held.append(mouth.holds)
        assert held == [True, False]
        assert tip_of(cell, plug)[0] < 0.0
        assert (p.getNumBodies(plug.client), p.getNumConstraints(plug.client)) == bodies


@pytest.mark.parametrize("force", [(0.0, 3.0, 0.0), (0.0, 0.0, -3.0)])
def test_a_seated_plug_bears_a_push_from_the_side(
    cell: CableCell, plug: FreePlug, mouth: SocketMouth, force: tuple[float, float, float]
) -> None:
    plug.put(before(cell))
    plug.advance(1.0, mouth, pushed(cell, BORE.insertion_force + 1.0))
    plug.advance(1.0, mouth, seat(cell).rotation.apply(np.array(force)))
    assert mouth.holds
    tilt = seat(cell).rotation.inv() * plug.state().pose.rotation
    assert float(tilt.apply([1.0, 0.0, 0.0])[0]) > np.cos(np.deg2rad(2.0))
    assert np.linalg.norm(plug.state().velocity) < 1e-3


def test_what_comes_through_the_block_s_side_is_not_met(cell: CableCell, plug: FreePlug, mouth: SocketMouth) -> None:
    plug.put(seat(cell) * RigidTransform.from_translation([0.0, 0.06, 0.0]))
    plug.advance(1.0, mouth, seat(cell).rotation.apply([0.0, -0.01, 0.0]))
    off = seat(cell).inv().apply(plug.state().pose.translation)
    assert off[1] < 0.0
    assert (off[0], off[2]) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_a_connector_that_starts_in_the_socket_is_not_held_by_its_mouth(
    cell: CableCell, plug: FreePlug, mouth: SocketMouth
) -> None:
    plug.put(seat(cell))
    plug.advance(0.5, mouth)
    assert not mouth.holds
    assert plug.state().pose.translation == pytest.approx(seat(cell).translation)
