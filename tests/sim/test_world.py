"""A world without a task's objects: its clock, its arms, what touches, and what is put in."""

import gc
from collections.abc import Iterator

import numpy as np
import pybullet as p
import pytest
from hand import drive, kinematics, nearest
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cell import Box, Cell
from regrasp.interfaces.devices import Clock
from regrasp.interfaces.scene import Obstacle, Prop, SceneSetup
from regrasp.interfaces.wall_time import measured
from regrasp.sim.objects import NoObjects
from regrasp.sim.world import World


@pytest.fixture(scope="module")
def still(cell: Cell) -> Iterator[World[NoObjects]]:
    """A world in which nothing has moved."""
    world = World(cell, "zero", 1, NoObjects())
    yield world
    world.close()


def test_it_is_a_clock(cell: Cell, still: World[NoObjects]) -> None:
    clock: Clock = still
    before = clock.now()
    still.advance(0.25)
    assert clock.now() - before == pytest.approx(0.25)


def test_it_starts_with_its_arms_at_rest_and_touching_nothing(cell: Cell, still: World[NoObjects]) -> None:
    for name, arm in still.arms.items():
        np.testing.assert_allclose(arm.reading().positions, cell.known.arm(name).sleep, atol=2e-3)
    assert still.contact_peaks == {}


def test_an_arm_against_the_panel_is_counted_with_its_force(cell: Cell) -> None:
    world = World(cell, "zero", 1, NoObjects())
    robot, q = kinematics(world, "right"), np.zeros(6)
    ahead = RigidTransform.from_translation([0.44, -0.15, 0.30])
    before = nearest(robot.ik(ahead), q)
    drive(world, "right", before, 2.0)
    assert world.contact_peaks == {}
    drive(world, "right", nearest(robot.ik(RigidTransform.from_translation([0.08, 0, 0]) * ahead), before), 1.0)
    assert set(world.contact_peaks) == {"right arm - back_panel"}
    assert world.contact_peaks["right arm - back_panel"] > 5.0  # N
    world.close()


def test_obstacles_stand_where_they_were_put(cell: Cell) -> None:
    box = Box(name="tall", center=(0.3, 0.2, 0.18), size=(0.12, 0.08, 0.36))
    stand = Box(name="leg", center=(0.3, 0.2, 0.05), size=(0.02, 0.02, 0.1))
    world = World(cell, "zero", 1, NoObjects(), setup=SceneSetup((Obstacle(box, np.pi / 2, stand),)))
    lower, upper = p.getAABB(world.fixed_bodies["obstacle tall"], physicsClientId=world.client)
    np.testing.assert_allclose(np.subtract(upper, lower), [0.08, 0.12, 0.36], atol=5e-3)
    np.testing.assert_allclose(np.add(upper, lower) / 2, box.center, atol=1e-6)
    assert "obstacle leg" in world.fixed_bodies
    world.close()


def test_props_are_seen_where_they_are_placed_and_stop_nothing(cell: Cell) -> None:
    props = (Prop("ball", (0.03,), (0.0, 1.0, 0.0)), Prop("rod", (0.2, 0.02), (0.0, 1.0, 0.0)))
    world = World(cell, "zero", 1, NoObjects(), setup=SceneSetup(props=props))
    rear = world.cameras["rear"]

    def green() -> NDArray[np.intp]:
        rgb = next(rear.static_frames(1)).rgb
        return np.argwhere((rgb[..., 1] > 60) & (rgb[..., 0] < 30) & (rgb[..., 2] < 30))

    assert len(green()) == 0
    world.place_prop(0, RigidTransform.from_translation([0.4, 0.1, 0.35]))
    ball = green()
    assert len(ball) > 50
    arm = world.arms["right"]
    before = arm.tool_pose().translation
    world.place_prop(0, RigidTransform.from_translation(before))
    world.advance(0.2)
    assert float(np.linalg.norm(arm.tool_pose().translation - before)) < 1e-4
    world.place_prop(0, None)
    world.place_prop(1, RigidTransform.from_components([0.3, 0.0, 0.3], Rotation.from_euler("z", 90, degrees=True)))
    rod = green()
    assert np.ptp(rod[:, 1]) > 2 * np.ptp(rod[:, 0])  # along the image's rows
    world.close()


def test_its_steps_count_as_physics_in_the_wall_time(still: World[NoObjects]) -> None:
    with measured("tree") as wall:
        still.advance(0.1)
        wall.switch("tree")
    assert 0.0 < wall.seconds["physics"] < wall.seconds["physics"] + wall.seconds["step loop"] < 10.0


def test_a_world_that_nobody_closes_leaves_no_client_behind(cell: Cell) -> None:
    world = World(cell, "zero", 0, NoObjects())
    client = world.client
    assert p.getConnectionInfo(client)["isConnected"]
    del world
    gc.collect()
    assert not p.getConnectionInfo(client)["isConnected"]
