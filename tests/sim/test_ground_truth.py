"""What is true in every world: who touches what, and what a camera sees of a body."""

from collections.abc import Iterator, Mapping

import numpy as np
import pybullet as p
import pytest

from regrasp.interfaces.cell import Box, Cell
from regrasp.interfaces.scene import Obstacle, SceneSetup
from regrasp.sim.bodies import build_box
from regrasp.sim.engine import Engine
from regrasp.sim.ground_truth import GroundTruth
from regrasp.sim.objects import NoObjects, TaskObjects
from regrasp.sim.world import World

PLACE = (0.40, 0.0, 0.30)  # m, of a plate that faces the rear camera
FRONT = np.array([0.30, 0.0, 0.30])  # m, on the way to it


class Plate(TaskObjects):
    """A plate before the panel."""

    def build_fixed(self, engine: Engine) -> Mapping[str, int]:
        return {"plate": build_box(engine.client, Box(name="plate", center=PLACE, size=(0.01, 0.06, 0.06)))}


@pytest.fixture(scope="module")
def world(cell: Cell) -> Iterator[World[Plate]]:
    screen = Obstacle(Box(name="screen", center=(0.3, 0.8, 0.3), size=(0.01, 0.2, 0.2)), 0.0, None)
    world = World(cell, "zero", 1, Plate(), SceneSetup((screen,)))
    yield world
    world.close()


def test_contact_peaks_are_a_copy(cell: Cell) -> None:
    world = World(cell, "zero", 1, NoObjects())
    truth = GroundTruth(world)
    truth.contact_peaks()["left arm - floor"] = 9.0
    assert "left arm - floor" not in truth.contact_peaks()
    world.close()


def test_a_body_s_pixels_are_those_of_the_newest_frame(world: World[Plate]) -> None:
    truth, plate = GroundTruth(world), world.fixed_bodies["plate"]
    assert truth.pixels("rear", plate) == 0  # before the first frame
    world.advance(0.2)
    k = world.cell.known.camera("rear").intrinsics
    distance = PLACE[0] - world.cameras["rear"].true_pose().translation[0]
    assert truth.pixels("rear", plate) == pytest.approx((0.06 * k.fx / distance) ** 2, rel=0.25)
    wrist = world.arms["left"].links["vx300s/wrist_link"]
    ids = world.cameras["rear"].true_ids()
    assert ids is not None
    assert truth.pixels("rear", world.arms["left"].body, wrist) < np.count_nonzero(ids > -1)


def test_an_obstacle_s_edge_occludes_the_share_that_it_covers(world: World[Plate]) -> None:
    truth, plate = GroundTruth(world), world.fixed_bodies["plate"]
    shares = []
    for aside in np.linspace(0.0, 0.2, 9):
        world.place_obstacle("screen", FRONT + np.array([0.0, aside, 0.0]))
        shares.append(truth.occlusion("rear", plate))
    assert shares[0] == 1.0
    assert shares == sorted(shares, reverse=True)
    assert any(0.2 < share < 0.8 for share in shares)
    assert shares[-1] == 0.0


def test_what_is_left_out_of_a_link_is_not_occluded(world: World[Plate]) -> None:
    truth, plate = GroundTruth(world), world.fixed_bodies["plate"]
    with pytest.raises(ZeroDivisionError):
        truth.occlusion("rear", plate, left_out=lambda item: item.kind == p.GEOM_BOX)
