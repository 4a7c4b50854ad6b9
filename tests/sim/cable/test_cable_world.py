"""The whole cell with its cable: what holds, what lets go, and that it is the same every time."""

import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pybullet as p
import pytest
from hand import draw as pull
from hand import take_hold
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableCell
from regrasp.sim.cable.ground_truth import CableTruth
from regrasp.sim.cable.objects import CableObjects, cable_world
from regrasp.sim.world import World

DRIFT = 1e-4  # m in 3 s
CREEP = 1e-3  # m in 2 s


@pytest.fixture(scope="module")
def plugged(cell: CableCell) -> Iterator[World[CableObjects]]:
    """A world in which nothing has moved; tests leave the connector plugged."""
    world = cable_world(cell, "zero", seed=1)
    yield world
    world.close()


@dataclass
class Pull:
    """What was seen while the hand took the plugged connector and drew it out."""

    world: World[CableObjects]
    plugged_when_held: bool
    joined_when_held: list[tuple[int, int]]
    plugged_when_drawn: bool
    joined_when_drawn: list[tuple[int, int]]
    in_hand: list[RigidTransform]  # tool_from_connector, every 0.1 s of 2 s


def joined(world: World[CableObjects]) -> list[tuple[int, int]]:
    """The bodies of every constraint: (parent, child)."""
    ids = [p.getConstraintUniqueId(i, world.client) for i in range(p.getNumConstraints(world.client))]
    infos = [p.getConstraintInfo(c, world.client) for c in ids]
    return [(info[0], info[2]) for info in infos]


@pytest.fixture(scope="module")
def drawn(cell: CableCell) -> Iterator[Pull]:
    world = cable_world(cell, "zero", seed=3)
    take_hold(world)
    held, joined_when_held = world.objects.socket.holds, joined(world)
    axis = world.objects.connector_pose().rotation.apply([1.0, 0.0, 0.0])
    pull(world, -0.06 * axis, 1.5)
    seen = Pull(world, held, joined_when_held, world.objects.socket.holds, joined(world), [])
    for _ in range(21):
        seen.in_hand.append(world.arms["right"].tool_pose().inv() * world.objects.connector_pose())
        world.advance(0.1)
    yield seen
    world.close()


def push(world: World[CableObjects], force: FloatArray, seconds: float) -> None:
    """Pull at the connector's centre with `force` (3,) N."""
    for _ in range(round(seconds / world.step_seconds)):
        at = world.objects.connector_pose().translation.tolist()
        body, link = world.objects.cable.body, world.objects.cable.connector_link
        p.applyExternalForce(body, link, force.tolist(), at, p.WORLD_FRAME, physicsClientId=world.client)
        world.advance(world.step_seconds)


def middle_of_cable(world: World[CableObjects]) -> FloatArray:
    links = [5, 10, 15]
    states = p.getLinkStates(world.objects.cable.body, links, 0, 1, physicsClientId=world.client)
    return np.array([s[4] for s in states])


def test_the_connector_starts_in_its_socket(cell: CableCell, plugged: World[CableObjects]) -> None:
    known = cell.known
    goal = known.cable.socket(known.cable.plugged_into).world_from_plug(known.cable.connector.length)
    off = goal.inv() * plugged.objects.connector_pose()
    assert float(np.linalg.norm(off.translation)) < 1e-3
    assert float(off.rotation.magnitude()) < np.deg2rad(1.0)
    assert plugged.objects.socket.holds


def test_a_cable_held_at_both_ends_does_not_drift(plugged: World[CableObjects]) -> None:
    cable, end = middle_of_cable(plugged), plugged.objects.connector_pose().translation
    plugged.advance(3.0)
    assert float(np.abs(middle_of_cable(plugged) - cable).max()) < DRIFT
    assert float(np.abs(plugged.objects.connector_pose().translation - end).max()) < DRIFT


def test_the_socket_lets_go_above_its_force_only(cell: CableCell) -> None:
    world = cable_world(cell, "zero", seed=2)
    truth = CableTruth(world)
    axis = world.objects.connector_pose().rotation.apply([1.0, 0.0, 0.0])
    start = world.objects.connector_pose().translation
    push(world, -5.0 * axis, 1.0)
    assert truth.plugged()
    assert float(np.linalg.norm(world.objects.connector_pose().translation - start)) < 1e-3
    push(world, -15.0 * axis, 0.05)
    assert not truth.plugged()
    assert float((world.objects.connector_pose().translation - start) @ axis) < -0.01
    world.close()


def test_friction_alone_draws_the_plug(drawn: Pull) -> None:
    assert drawn.plugged_when_held
    assert not drawn.plugged_when_drawn
    assert all(drawn.world.objects.pads_touching("right"))
    moved = drawn.in_hand[-1].translation - drawn.in_hand[0].translation
    assert float(np.linalg.norm(moved)) < CREEP
    assert float(np.ptp([pose.translation for pose in drawn.in_hand], axis=0).max()) < CREEP


def test_no_constraint_joins_hand_and_cable(drawn: Pull) -> None:
    world = drawn.world
    gears = [(arm.body, arm.body) for arm in world.arms.values()]
    assert sorted(drawn.joined_when_drawn) == sorted(gears)
    assert sorted(drawn.joined_when_held) == sorted([*gears, (world.objects.cable.body, -1)])


def test_a_grasp_is_no_contact_to_complain_of(drawn: Pull) -> None:
    assert drawn.world.contact_peaks == {}


def test_an_opened_hand_loses_the_connector(drawn: Pull) -> None:
    """Runs after those that need the hold."""
    world = drawn.world
    world.arms["right"].gripper.open(0.07)
    world.advance(1.5)
    assert world.objects.pads_touching("right") == (False, False)
    off = world.arms["right"].tool_pose().translation - world.objects.connector_pose().translation
    assert float(np.linalg.norm(off)) > 0.03


def test_a_connector_may_start_on_a_stand(cell: CableCell) -> None:
    asked = RigidTransform.from_components([0.38, 0.06, 0.29], Rotation.from_euler("zy", [100.0, -20.0], degrees=True))
    world = cable_world(cell, "zero", seed=1, connector_at=asked)
    off = asked.inv() * world.objects.connector_pose()
    assert world.objects.socket.holds
    assert float(np.linalg.norm(off.translation)) < 1e-3
    assert float(off.rotation.magnitude()) < np.deg2rad(1.0)
    push(world, np.array([0.0, 0.0, 12.0]), 0.05)
    assert not CableTruth(world).plugged()
    world.close()


def test_under_gravity_a_loose_end_hangs(cell: CableCell) -> None:
    world = cable_world(cell, "earth", seed=1)
    push(world, -15.0 * world.objects.connector_pose().rotation.apply([1.0, 0.0, 0.0]), 0.05)
    world.advance(4.0)
    droop = cell.hidden.cable.anchor[2] - world.objects.connector_pose().translation[2]
    assert 0.08 < droop < 0.20  # m; the cell file states 0.14
    world.close()


def test_two_processes_agree_bit_for_bit_whoever_looks() -> None:
    script = str(Path(__file__).parents[2] / "support" / "world_digest.py")
    runs = [
        subprocess.Popen([sys.executable, script, *more], stdout=subprocess.PIPE, text=True)
        for more in ([], [], ["second reader"])
    ]
    digests = [run.communicate()[0].split()[-1] for run in runs]
    assert all(run.returncode == 0 for run in runs)
    assert len(digests[0]) == 64
    assert digests == [digests[0]] * 3
