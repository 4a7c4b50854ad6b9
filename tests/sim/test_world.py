"""The whole cell: what holds, what lets go, what touches, and that it is the same every time."""

import gc
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pybullet as p
import pytest
from hand import draw as pull
from hand import drive, kinematics, nearest, take_hold
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.cell import Box
from regrasp.interfaces.devices import Clock
from regrasp.interfaces.scene import Obstacle, Prop, SceneSetup
from regrasp.sim.ground_truth import GroundTruth
from regrasp.sim.world import World

DRIFT = 1e-4  # m in 3 s
CREEP = 1e-3  # m in 2 s


@pytest.fixture(scope="module")
def plugged(cell: CableCell) -> Iterator[World]:
    """A world in which nothing has moved; tests leave the connector plugged."""
    world = World(cell, "zero", seed=1, renderer="software")
    yield world
    world.close()


@dataclass
class Pull:
    """What was seen while the right hand took the plugged connector and drew it out."""

    world: World
    plugged_when_held: bool
    joined_when_held: list[tuple[int, int]]
    plugged_when_drawn: bool
    joined_when_drawn: list[tuple[int, int]]
    in_hand: list[RigidTransform]  # tool_from_connector, every 0.1 s of 2 s


def joined(world: World) -> list[tuple[int, int]]:
    """The bodies of every constraint: (parent, child)."""
    ids = [p.getConstraintUniqueId(i, world.client) for i in range(p.getNumConstraints(world.client))]
    infos = [p.getConstraintInfo(c, world.client) for c in ids]
    return [(info[0], info[2]) for info in infos]


@pytest.fixture(scope="module")
def drawn(cell: CableCell) -> Iterator[Pull]:
    world = World(cell, "zero", seed=3, renderer="software")
    take_hold(world)
    held, joined_when_held = world.socket.holds, joined(world)
    axis = world.connector_pose().rotation.apply([1.0, 0.0, 0.0])
    pull(world, -0.06 * axis, 1.5)
    seen = Pull(world, held, joined_when_held, world.socket.holds, joined(world), [])
    for _ in range(21):
        seen.in_hand.append(world.arms["right"].tool_pose().inv() * world.connector_pose())
        world.advance(0.1)
    yield seen
    world.close()


def push(world: World, force: FloatArray, seconds: float) -> None:
    """Pull at the connector's centre with `force` (3,) N."""
    for _ in range(round(seconds / world.step_seconds)):
        at = world.connector_pose().translation.tolist()
        body, link = world.cable.body, world.cable.connector_link
        p.applyExternalForce(body, link, force.tolist(), at, p.WORLD_FRAME, physicsClientId=world.client)
        world.advance(world.step_seconds)


def middle_of_cable(world: World) -> FloatArray:
    links = [5, 10, 15]
    states = p.getLinkStates(world.cable.body, links, 0, 1, physicsClientId=world.client)
    return np.array([s[4] for s in states])


def test_it_is_a_clock(cell: CableCell, plugged: World) -> None:
    clock: Clock = plugged
    before = clock.now()
    plugged.advance(0.25)
    assert clock.now() - before == pytest.approx(0.25)


def test_the_connector_starts_in_its_socket(cell: CableCell, plugged: World) -> None:
    known = cell.known
    goal = known.cable.socket(known.cable.plugged_into).world_from_plug(known.cable.connector.length)
    off = goal.inv() * plugged.connector_pose()
    assert float(np.linalg.norm(off.translation)) < 1e-3
    assert float(off.rotation.magnitude()) < np.deg2rad(1.0)
    assert plugged.socket.holds


def test_a_cable_held_at_both_ends_does_not_drift(plugged: World) -> None:
    cable, end = middle_of_cable(plugged), plugged.connector_pose().translation
    plugged.advance(3.0)
    assert float(np.abs(middle_of_cable(plugged) - cable).max()) < DRIFT
    assert float(np.abs(plugged.connector_pose().translation - end).max()) < DRIFT


def test_it_starts_with_its_arms_at_rest_and_touching_nothing(cell: CableCell, plugged: World) -> None:
    for name, arm in plugged.arms.items():
        np.testing.assert_allclose(arm.reading().positions, cell.known.arm(name).sleep, atol=2e-3)
    assert plugged.contact_peaks == {}


def test_the_socket_lets_go_above_its_force_only(cell: CableCell) -> None:
    world = World(cell, "zero", seed=2, renderer="software")
    truth = GroundTruth(world)
    axis = world.connector_pose().rotation.apply([1.0, 0.0, 0.0])
    start = world.connector_pose().translation
    push(world, -5.0 * axis, 1.0)
    assert truth.plugged()
    assert float(np.linalg.norm(world.connector_pose().translation - start)) < 1e-3
    push(world, -15.0 * axis, 0.05)
    assert not truth.plugged()
    assert float((world.connector_pose().translation - start) @ axis) < -0.01
    world.close()


def test_friction_alone_draws_the_plug(drawn: Pull) -> None:
    assert drawn.plugged_when_held
    assert not drawn.plugged_when_drawn
    assert all(drawn.world.pads_touching("right"))
    moved = drawn.in_hand[-1].translation - drawn.in_hand[0].translation
    assert float(np.linalg.norm(moved)) < CREEP
    assert float(np.ptp([pose.translation for pose in drawn.in_hand], axis=0).max()) < CREEP


def test_no_constraint_joins_hand_and_cable(drawn: Pull) -> None:
    world = drawn.world
    gears = [(arm.body, arm.body) for arm in world.arms.values()]
    assert sorted(drawn.joined_when_drawn) == sorted(gears)
    assert sorted(drawn.joined_when_held) == sorted([*gears, (world.cable.body, -1)])


def test_a_grasp_is_no_contact_to_complain_of(drawn: Pull) -> None:
    assert drawn.world.contact_peaks == {}


def test_an_opened_hand_loses_the_connector(drawn: Pull) -> None:
    """Runs after those that need the hold."""
    world = drawn.world
    world.arms["right"].gripper.open(0.07)
    world.advance(1.5)
    assert world.pads_touching("right") == (False, False)
    off = world.arms["right"].tool_pose().translation - world.connector_pose().translation
    assert float(np.linalg.norm(off)) > 0.03


def test_an_arm_against_the_panel_is_counted_with_its_force(cell: CableCell) -> None:
    world = World(cell, "zero", seed=1, renderer="software")
    robot, q = kinematics(world, "right"), np.zeros(6)
    ahead = RigidTransform.from_translation([0.44, -0.15, 0.30])
    before = nearest(robot.ik(ahead), q)
    drive(world, "right", before, 2.0)
    assert world.contact_peaks == {}
    drive(world, "right", nearest(robot.ik(RigidTransform.from_translation([0.08, 0, 0]) * ahead), before), 1.0)
    assert set(world.contact_peaks) == {"right arm - back_panel"}
    assert world.contact_peaks["right arm - back_panel"] > 5.0  # N
    world.close()


def test_obstacles_stand_where_they_were_put(cell: CableCell) -> None:
    box = Box(name="tall", center=(0.3, 0.2, 0.18), size=(0.12, 0.08, 0.36))
    stand = Box(name="leg", center=(0.3, 0.2, 0.05), size=(0.02, 0.02, 0.1))
    world = World(cell, "zero", seed=1, setup=SceneSetup((Obstacle(box, np.pi / 2, stand),)), renderer="software")
    lower, upper = p.getAABB(world.boxes["obstacle tall"], physicsClientId=world.client)
    np.testing.assert_allclose(np.subtract(upper, lower), [0.08, 0.12, 0.36], atol=5e-3)
    np.testing.assert_allclose(np.add(upper, lower) / 2, box.center, atol=1e-6)
    assert "obstacle leg" in world.boxes
    world.close()


def test_a_connector_may_start_on_a_stand(cell: CableCell) -> None:
    asked = RigidTransform.from_components([0.38, 0.06, 0.29], Rotation.from_euler("zy", [100.0, -20.0], degrees=True))
    world = World(cell, "zero", seed=1, setup=SceneSetup(connector_at=asked), renderer="software")
    off = asked.inv() * world.connector_pose()
    assert world.socket.holds
    assert float(np.linalg.norm(off.translation)) < 1e-3
    assert float(off.rotation.magnitude()) < np.deg2rad(1.0)
    push(world, np.array([0.0, 0.0, 12.0]), 0.05)
    assert not GroundTruth(world).plugged()
    world.close()


def test_props_are_seen_where_they_are_placed_and_stop_nothing(cell: CableCell) -> None:
    props = (Prop("ball", (0.03,), (0.0, 1.0, 0.0)), Prop("rod", (0.2, 0.02), (0.0, 1.0, 0.0)))
    world = World(cell, "zero", seed=1, setup=SceneSetup(props=props), renderer="software")
    rear = world.cameras["rear"]

    def green() -> NDArray[np.intp]:
        rgb = next(rear.static_frames(1)).rgb
        return np.argwhere((rgb[..., 1] > 60) & (rgb[..., 0] < 30) & (rgb[..., 2] < 30))

    assert len(green()) == 0
    world.place_prop(0, RigidTransform.from_translation(world.connector_pose().translation))
    ball = green()
    assert len(ball) > 50
    before = world.connector_pose().translation
    world.advance(0.2)
    assert float(np.linalg.norm(world.connector_pose().translation - before)) < 1e-4
    world.place_prop(0, None)
    world.place_prop(1, RigidTransform.from_components([0.3, 0.0, 0.3], Rotation.from_euler("z", 90, degrees=True)))
    rod = green()
    assert np.ptp(rod[:, 1]) > 2 * np.ptp(rod[:, 0])  # along the image's rows
    world.close()


def test_under_gravity_a_loose_end_hangs(cell: CableCell) -> None:
    world = World(cell, "earth", seed=1, renderer="software")
    push(world, -15.0 * world.connector_pose().rotation.apply([1.0, 0.0, 0.0]), 0.05)
    world.advance(4.0)
    droop = cell.hidden.cable.anchor[2] - world.connector_pose().translation[2]
    assert 0.08 < droop < 0.20  # m; the cell file states 0.14
    world.close()


def test_two_processes_agree_bit_for_bit_whoever_looks() -> None:
    script = str(Path(__file__).parents[1] / "support" / "world_digest.py")
    runs = [
        subprocess.Popen([sys.executable, script, *more], stdout=subprocess.PIPE, text=True)
        for more in ([], [], ["second reader"])
    ]
    digests = [run.communicate()[0].split()[-1] for run in runs]
    assert all(run.returncode == 0 for run in runs)
    assert len(digests[0]) == 64
    assert digests == [digests[0]] * 3


def test_a_world_that_nobody_closes_leaves_no_client_behind(cell: CableCell) -> None:
    world = World(cell, "zero", 0)
    client = world.client
    assert p.getConnectionInfo(client)["isConnected"]
    del world
    gc.collect()
    assert not p.getConnectionInfo(client)["isConnected"]
