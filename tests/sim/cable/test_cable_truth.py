"""What is true of the connector: where it is, what holds it, and who sees it."""

from collections.abc import Iterator

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.cell import Box, FixedMount
from regrasp.interfaces.scene import Obstacle, SceneSetup
from regrasp.sim.cable.ground_truth import CableTruth
from regrasp.sim.cable.objects import CableObjects, cable_world
from regrasp.sim.world import World


@pytest.fixture(scope="module")
def world(cell: CableCell) -> Iterator[World[CableObjects]]:
    world = cable_world(cell, "zero", seed=1)
    world.advance(0.2)
    yield world
    world.close()


def test_a_plugged_connector_at_rest(world: World[CableObjects]) -> None:
    truth = CableTruth(world)
    assert truth.plugged()
    assert not truth.stowed()
    assert not truth.held()
    assert not truth.touched()
    assert truth.connector_speed() < 1e-3
    np.testing.assert_array_equal(truth.connector_pose().as_matrix(), world.objects.connector_pose().as_matrix())


def test_the_rear_camera_sees_the_red(world: World[CableObjects]) -> None:
    frame = world.cameras["rear"].latest()
    assert frame is not None
    red = (frame.rgb[..., 0] > 60) & (frame.rgb[..., 1] < 40) & (frame.rgb[..., 2] < 40)
    pixels = CableTruth(world).connector_pixels("rear")
    assert pixels > 20
    assert pixels == pytest.approx(int(red.sum()), rel=0.1)


def test_before_the_first_frame_no_pixels(cell: CableCell) -> None:
    world = cable_world(cell, "zero", seed=1)
    assert world.cameras["rear"].latest() is None
    assert CableTruth(world).connector_pixels("rear") == 0
    world.close()


def test_behind_an_obstacle_no_pixels(cell: CableCell, world: World[CableObjects]) -> None:
    camera, connector = cell.known.camera("rear").mount, world.objects.connector_pose().translation
    assert isinstance(camera, FixedMount)
    middle = connector + 0.3 * (np.asarray(camera.position) - connector)
    box = Box(name="wall", center=(middle[0], middle[1], middle[2]), size=(0.01, 0.2, 0.2))
    hidden = cable_world(cell, "zero", seed=1, setup=SceneSetup((Obstacle(box, 0.0, None),)))
    hidden.advance(0.2)
    assert CableTruth(hidden).connector_pixels("rear") == 0
    assert CableTruth(hidden).occluded_share("rear") == 1.0
    shares = []
    for aside in np.linspace(0.0, 0.14, 8):  # the wall's left edge passes the connector
        hidden.place_obstacle("wall", middle - [0.0, aside, 0.0])
        shares.append(CableTruth(hidden).occluded_share("rear"))
    assert shares == sorted(shares, reverse=True)
    assert any(0.2 < share < 0.8 for share in shares)
    assert shares[-1] == 0.0
    hidden.close()


def test_the_seat_s_error_is_a_way_and_an_angle(
    cell: CableCell, world: World[CableObjects], monkeypatch: pytest.MonkeyPatch
) -> None:
    seat = cell.known.cable.clip.world_from_seat
    turn = Rotation.from_euler("zx", [10.0, 77.0], degrees=True)  # about its own axis it may turn
    moved = RigidTransform.from_components([0.0, 0.003, 0.004], turn)
    monkeypatch.setattr(world.objects, "connector_pose", lambda: seat * moved)
    assert CableTruth(world).seat_error() == pytest.approx((0.005, 10.0))


def test_a_cell_needs_neither_floor_nor_panels(cell: CableCell) -> None:
    bare = cell.model_copy(update={"known": cell.known.model_copy(update={"boxes": ()})})
    world = cable_world(bare, "zero", seed=1)
    world.advance(0.1)
    socket = next(s for s in bare.known.cable.sockets if s.name == bare.known.cable.plugged_into)
    place = socket.world_from_plug(bare.known.cable.connector.length).translation
    assert np.linalg.norm(world.objects.connector_pose().translation - place) < 0.02
    world.close()
