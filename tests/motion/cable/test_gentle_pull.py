"""A gentle pull tells what is held from what is not: by stated springs, and in the world."""

from collections.abc import Generator

import numpy as np
import pytest
from hand import take_hold
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableCell, CableKnown
from regrasp.interfaces.devices import TICK
from regrasp.interfaces.evidence import Evidence
from regrasp.interfaces.request import Request
from regrasp.interfaces.scene import Gravity
from regrasp.motion.cable.gentle_pull import across_the_cable, pull_gently
from regrasp.motion.cable.service import CableMotion
from regrasp.motion.planning.straight import straight_line
from regrasp.motion.robots.spheres import sphere_distances
from regrasp.sim.cable.objects import CableObjects, CableObjectsParameters
from regrasp.sim.world import NOTHING_ADDED, World

LIPS, CABLE = 1500.0, 100.0  # N/m
STRONG_STAND = CableObjectsParameters(stand_force=50.0)  # N; a bent cable tears itself from a weaker one


def pulled(stiffness: float, steady: float) -> Evidence:
    """A pull at a spring (N/m), while a force (N) pulls all the time."""

    def go_out(way: float) -> Generator[None, None, FloatArray]:
        yield
        return np.array([steady + stiffness * way])

    steps = pull_gently(go_out, lambda change: float(change[0]))
    try:
        while True:
            next(steps)
    except StopIteration as end:
        evidence: Evidence = end.value
        return evidence


@pytest.mark.parametrize("steady", [-10.0, 0.0, 10.0])
def test_what_pulls_all_the_time_does_not_matter(steady: float) -> None:
    held, loose = pulled(LIPS, steady), pulled(CABLE, steady)
    assert held.detected
    assert held.value == pytest.approx(LIPS)
    assert not loose.detected
    assert "0.10 N/mm" in loose.sentence


def test_it_pulls_across_the_cable_as_nearly_the_asked_way_as_may_be(known: CableKnown) -> None:
    seat, back = known.cable.clip.world_from_seat, np.array([-1.0, 0.0, 0.0])
    way = across_the_cable(known, seat, back)
    line = seat.apply([-0.5 * known.cable.connector.length, 0.0, 0.0]) - known.cable.anchor[0]
    assert np.linalg.norm(way) == pytest.approx(1.0)
    assert way @ line == pytest.approx(0.0)
    assert way @ back == pytest.approx(np.linalg.norm(np.cross(back, line)) / np.linalg.norm(line))


def settled(world: World[CableObjects]) -> tuple[CableMotion, RigidTransform]:
    """A hand that holds the connector, which no stand holds any more, and how it does (tool_from_connector)."""
    take_hold(world)
    world.objects.socket.release()
    world.advance(0.6)
    grippers = {name: arm.gripper for name, arm in world.arms.items()}
    motion = CableMotion(world.cell.known, world.arms, grippers, world, 0)  # type: ignore[arg-type]
    return motion, motion.tool(motion.hand).inv() * world.objects.connector_pose()


def done(world: World[CableObjects], request: Request[Evidence]) -> Evidence:
    while not request.poll():
        world.advance(TICK)
    return request.answer


@pytest.mark.parametrize("gravity", ["zero", "earth"])
@pytest.mark.parametrize(
    ("off", "seated"), [([0.0, 0.0, 0.0], True), ([-0.035, 0.0, 0.0], False), ([0.035, 0.0, 0.0], False)]
)
def test_in_the_world_a_connector_in_the_clip_is_told_from_one_before_or_behind_it(
    cell: CableCell, gravity: Gravity, off: list[float], seated: bool
) -> None:
    seat = cell.known.cable.clip.world_from_seat
    stand = RigidTransform.from_translation(off) * seat
    world = World(cell, gravity, 1, CableObjects(cell, stand, STRONG_STAND), NOTHING_ADDED)
    motion, held = settled(world)
    assert world.objects.clip.holds == seated
    before, begin = motion.tool(motion.hand), world.now()
    pull = done(world, motion.pull_at_clip(held))
    assert world.now() - begin < (2.0 if seated else 3.5)
    assert pull.detected == seated
    assert world.objects.clip.holds == seated
    moved = before.inv().apply(motion.tool(motion.hand).translation)
    distance = 0.0 if seated else motion.parameters.seating.clear
    assert moved == pytest.approx([-distance, 0.0, 0.0], abs=2e-3)
    world.close()


def test_the_hand_comes_back_out_of_the_clip_although_the_map_shows_something_there(cell: CableCell) -> None:
    """What a camera sees beside a held connector may be the connector: the way in was free."""
    stand = RigidTransform.from_translation([0.035, 0.0, 0.0]) * cell.known.cable.clip.world_from_seat
    world = World(cell, "zero", 1, CableObjects(cell, stand, STRONG_STAND), NOTHING_ADDED)
    motion, _ = settled(world)
    held = motion.tool(motion.hand).inv() * world.objects.connector_pose()
    before = motion.tool(motion.hand)
    back, kin = motion.parameters.seating.clear, motion.kinematics[motion.hand]
    end = straight_line(kin, motion.joints(motion.hand), before * RigidTransform.from_translation([-back, 0.0, 0.0]))[
        -1
    ]
    model = motion.model(motion.hand)
    spheres = model.spheres(end)
    behind = spheres[:, :3] + spheres[:, 3:] * before.rotation.apply([-1.0, 0.0, 0.0])
    in_the_way = sphere_distances(behind, model.spheres(motion.joints(motion.hand)))[0] > 0.025
    assert in_the_way.any()
    motion.set_obstacles(behind[in_the_way], 0.01)
    pull = done(world, motion.pull_at_clip(held))
    assert not pull.detected
    moved = before.inv().apply(motion.tool(motion.hand).translation)
    assert moved == pytest.approx([-back, 0.0, 0.0], abs=2e-3)
    world.close()
