from collections.abc import Iterator

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.cell import Box, FixedMount
from regrasp.interfaces.scene import Obstacle, SceneSetup
from regrasp.sim.ground_truth import GroundTruth
from regrasp.sim.world import World


@pytest.fixture(scope="module")
def world(cell: CableCell) -> Iterator[World]:
    world = World(cell, "zero", seed=1, renderer="software")
    world.advance(0.2)
    yield world
    world.close()


def test_a_plugged_connector_at_rest(world: World) -> None:
    truth = GroundTruth(world)
    assert truth.plugged()
    assert not truth.stowed()
    assert not truth.held()
    assert not truth.touched()
    assert truth.connector_speed() < 1e-3
    np.testing.assert_array_equal(truth.connector_pose().as_matrix(), world.connector_pose().as_matrix())


def test_the_rear_camera_sees_the_red(world: World) -> None:
    frame = world.cameras["rear"].latest()
    assert frame is not None
    red = (frame.rgb[..., 0] > 60) & (frame.rgb[..., 1] < 40) & (frame.rgb[..., 2] < 40)
    pixels = GroundTruth(world).connector_pixels("rear")
    assert pixels > 20
    assert pixels == pytest.approx(int(red.sum()), rel=0.1)


def test_before_the_first_frame_no_pixels(cell: CableCell) -> None:
    world = World(cell, "zero", seed=1, renderer="software")
    assert world.cameras["rear"].latest() is None
    assert GroundTruth(world).connector_pixels("rear") == 0
    world.close()


def test_behind_an_obstacle_no_pixels(cell: CableCell, world: World) -> None:
    camera, connector = cell.known.camera("rear").mount, world.connector_pose().translation
    assert isinstance(camera, FixedMount)
    middle = connector + 0.3 * (np.asarray(camera.position) - connector)
    box = Box(name="wall", center=(middle[0], middle[1], middle[2]), size=(0.01, 0.2, 0.2))
    hidden = World(cell, "zero", seed=1, setup=SceneSetup((Obstacle(box, 0.0, None),)), renderer="software")
    hidden.advance(0.2)
    assert GroundTruth(hidden).connector_pixels("rear") == 0
    assert GroundTruth(hidden).occluded_share("rear") == 1.0
    shares = []
    for aside in np.linspace(0.0, 0.14, 8):  # the wall's left edge passes the connector
        hidden.place_obstacle("wall", middle - [0.0, aside, 0.0])
        shares.append(GroundTruth(hidden).occluded_share("rear"))
    assert shares == sorted(shares, reverse=True)
    assert any(0.2 < share < 0.8 for share in shares)
    assert shares[-1] == 0.0
    hidden.close()


def test_the_seat_s_error_is_a_way_and_an_angle(cell: CableCell, world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    seat = cell.known.cable.clip.world_from_seat
    turn = Rotation.from_euler("zx", [10.0, 77.0], degrees=True)  # about its own axis it may turn
    moved = RigidTransform.from_components([0.0, 0.003, 0.004], turn)
    monkeypatch.setattr(world, "connector_pose", lambda: seat * moved)
    assert GroundTruth(world).seat_error() == pytest.approx((0.005, 10.0))


def test_contact_peaks_are_a_copy(world: World) -> None:
    truth = GroundTruth(world)
    truth.contact_peaks()["left arm - floor"] = 9.0
    assert "left arm - floor" not in truth.contact_peaks()


def test_a_cell_needs_neither_floor_nor_panels(cell: CableCell) -> None:
    bare = cell.model_copy(update={"known": cell.known.model_copy(update={"boxes": ()})})
    world = World(bare, "zero", seed=1, renderer="software")
    world.advance(0.1)
    socket = next(s for s in bare.known.cable.sockets if s.name == bare.known.cable.plugged_into)
    place = socket.world_from_plug(bare.known.cable.connector.length).translation
    assert np.linalg.norm(world.connector_pose().translation - place) < 0.02
    world.close()
