"""What each fault that every task may have does to a small world, and that a seed repeats it."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pybullet as p
import pytest
from fault_types import FAULT_TYPES
from hand import drive
from numpy.typing import NDArray

from regrasp.interfaces.cell import Box, Cell
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.scene import Obstacle, SceneSetup
from regrasp.interfaces.trajectory import Trajectory
from regrasp.sim.objects import NoObjects
from regrasp.sim.world import World

BLOCK = Obstacle(Box(name="block", center=(0.2, 0.6, 0.1), size=(0.1, 0.1, 0.2)), 0.0, None)
ON, OFF = 0.5, 1.0  # s: the faults of these tests begin and end then
Make = Callable[..., World[NoObjects]]


@pytest.fixture
def make(cell: Cell) -> Iterator[Make]:
    """Makes worlds with one fault from `ON` to `OFF`, and closes them."""
    made: list[World[NoObjects]] = []

    def world(
        kind: str, *, seconds: float | None = OFF - ON, seed: int = 4, on: float = ON, **values: Any
    ) -> World[NoObjects]:
        if "seconds" in FAULT_TYPES[kind].model_fields and seconds is not None:
            values["seconds"] = seconds
        data = {"type": kind, "when": {"at": (on, on)}, **values}
        fault = FAULT_TYPES[kind].model_validate(data)
        made.append(World(cell, "zero", seed, NoObjects(), SceneSetup((BLOCK,), (fault,))))
        return made[-1]

    yield world
    for one in made:
        one.close()


def frames(world: World[NoObjects], camera: str, seconds: float) -> list[RgbdFrame]:
    """Every frame that comes within so long."""
    found: dict[int, RgbdFrame] = {}
    for _ in range(round(seconds / 0.02)):
        world.advance(0.02)
        frame = world.cameras[camera].latest()
        if frame is not None:
            found[frame.number] = frame
    return [found[number] for number in sorted(found)]


def split(seen: list[RgbdFrame]) -> tuple[list[RgbdFrame], list[RgbdFrame], list[RgbdFrame]]:
    """Frames exposed before, during and after the fault."""
    before, after = [f for f in seen if f.stamp < ON], [f for f in seen if f.stamp > OFF + 0.02]
    return before, [f for f in seen if ON + 0.02 < f.stamp < OFF], after


# --- cameras


def test_a_camera_drops_its_share_of_frames_and_a_seed_repeats_which(make: Make) -> None:
    numbers = [[f.number for f in frames(make("camera_drops", camera="rear", share=0.5, seed=s), "rear", 1.5)]
               for s in (4, 4, 5)]  # fmt: skip
    assert numbers[0] == numbers[1]
    assert numbers[0] != numbers[2]
    kept = [n for n in numbers[0] if ON < (n - 1) / 15 < OFF]
    assert 0 < len(kept) < 7
    assert [n for n in numbers[0] if (n - 1) / 15 > OFF + 0.02] == list(range(17, 24))


def test_a_stream_that_drops_all_stands_still(make: Make) -> None:
    world = make("camera_drops", camera="rear", share=1.0)
    world.advance(OFF - 0.1)
    frame = world.cameras["rear"].latest()
    assert frame is not None
    assert frame.stamp <= ON + 0.01


def test_a_frozen_camera_repeats_its_picture_under_fresh_stamps(make: Make) -> None:
    before, during, after = split(frames(make("camera_freezes", camera="rear"), "rear", 1.5))
    assert len(during) >= 6
    assert len({f.stamp for f in during}) == len({f.number for f in during}) == len(during)
    for frame in during:
        assert np.array_equal(frame.depth, before[-1].depth)
        assert np.array_equal(frame.rgb, before[-1].rgb)
    assert not np.array_equal(before[-2].depth, before[-1].depth)
    assert not np.array_equal(after[0].depth, before[-1].depth)


@pytest.mark.parametrize(("kind", "dark"), [("camera_dark", True), ("camera_loses_depth", False)])
def test_a_camera_without_depth_or_light(make: Make, kind: str, dark: bool) -> None:
    before, during, after = split(frames(make(kind, camera="wrist"), "wrist", 1.5))
    assert all(not f.depth.any() for f in during)
    assert all((f.rgb.mean() < 6) == dark for f in during)
    assert all(f.depth.any() and f.rgb.mean() > 30 for f in (*before, *after))


def test_a_fault_of_one_camera_leaves_the_other_alone(make: Make) -> None:
    world = make("camera_dark", camera="wrist")
    assert all(f.rgb.mean() > 30 for f in frames(world, "rear", OFF))


def test_the_light_changes_for_both_cameras(make: Make) -> None:
    world = make("light_changes", factor=0.4, direction=(0.2, -1.0, 1.0))
    before, during, after = split(frames(world, "rear", 1.5))
    assert during[0].rgb.mean() == pytest.approx(0.4 * before[0].rgb.mean(), rel=0.3)
    assert np.array_equal(before[0].rgb, after[0].rgb)  # the light is the same again, and nothing moves


# --- arms


def swing(world: World[NoObjects], joint: int, turn: float, seconds: float) -> None:
    """Start to turn a joint of the right arm at an even rate."""
    start = world.arms["right"].reading().positions
    goal = start + turn * np.eye(6)[joint]
    rates = np.tile((goal - start) / seconds, (2, 1))
    world.arms["right"].follow(Trajectory(np.array([0.0, seconds]), np.array([start, goal]), rates))


def angles(world: World[NoObjects], joint: int, seconds: float) -> NDArray[np.float64]:
    """How far a joint of the right arm has turned from its sleep pose, every 0.1 s."""
    sleep = world.cell.known.arm("right").sleep[joint]
    found = []
    for _ in range(round(seconds / 0.1)):
        world.advance(0.1)
        found.append(world.arms["right"].reading().positions[joint] - sleep)
    return np.array(found)


def test_a_stalled_joint_stands_and_then_catches_up(make: Make) -> None:
    world = make("joint_stalls", arm="right", joint="shoulder")
    swing(world, 1, 0.6, 1.2)
    turned = angles(world, 1, 2.0)
    assert turned[3] == pytest.approx(0.2, abs=0.02)
    assert np.ptp(turned[5:9]) < 0.01
    assert turned[-1] == pytest.approx(0.6, abs=0.01)


def test_a_stopped_arm_does_not_start_again_when_a_stall_ends(make: Make) -> None:
    world = make("joint_stalls", arm="right", joint="shoulder")
    swing(world, 1, 0.6, 1.2)
    world.advance(0.8)
    world.arms["right"].stop()
    stopped = angles(world, 1, 1.5)
    assert np.ptp(stopped) < 0.01


def test_a_lagging_joint_turns_at_its_share_of_the_speed(make: Make) -> None:
    world = make("joint_lags", arm="right", joint="shoulder", speed_share=0.05, seconds=None)
    swing(world, 1, 0.6, 1.2)
    turned = angles(world, 1, 5.0)
    assert np.diff(turned[7:12]) == pytest.approx(0.05 * np.pi * 0.1, rel=0.1)
    assert turned[-1] == pytest.approx(0.6, abs=0.01)


def test_a_slipped_encoder_reads_off_from_then_on_and_nothing_moves(make: Make) -> None:
    world = make("encoder_jumps", arm="right", joint="waist", angle=0.3)
    at = world.arms["right"].tool_pose().translation
    turned = angles(world, 0, 1.5)
    assert turned[3] == pytest.approx(0.0, abs=0.01)
    assert turned[5:] == pytest.approx(0.3, abs=0.01)
    assert world.arms["right"].tool_pose().translation == pytest.approx(at, abs=1e-3)


# --- the jaw


def test_a_stuck_jaw_takes_no_command_and_then_the_newest(make: Make) -> None:
    world = make("jaw_stuck")
    jaw = world.arms["right"].gripper
    jaw.open(0.03)
    world.advance(ON + 0.1)
    jaw.open(0.05)
    world.advance(OFF - ON - 0.15)
    assert jaw.true_gap() == pytest.approx(0.03, abs=0.001)
    world.advance(1.0)
    assert jaw.true_gap() == pytest.approx(0.05, abs=0.001)


@pytest.mark.parametrize("arm", ["left", "right"])
def test_a_jaw_s_fault_is_that_of_its_arm(make: Make, arm: str) -> None:
    world = make("jaw_opens", arm=arm, seconds=None, on=0.0)
    world.advance(0.8)
    assert [name for name, each in world.arms.items() if each.gripper.true_gap() > 0.05] == [arm]


@pytest.mark.parametrize(("share", "stalls"), [(0.0, True), (1.0, False)])
def test_a_weak_jaw_closes_with_its_share_of_the_force(make: Make, share: float, stalls: bool) -> None:
    world = make("jaw_weakens", force_share=share, seconds=None, on=0.0)
    jaw = world.arms["right"].gripper
    jaw.open(0.05)
    world.advance(0.8)
    jaw.close(15.0)
    world.advance(0.8)
    assert (jaw.true_gap() > 0.03) == stalls


# --- things


def test_an_obstacle_slides_along_its_line_and_stands(make: Make) -> None:
    world = make("obstacle_moves_in", obstacle="block", by=(0.0, -0.3, 0.1), speed=0.5, seconds=None)
    body = world.fixed_bodies["obstacle block"]

    def place() -> NDArray[np.float64]:
        return np.array(p.getBasePositionAndOrientation(body, physicsClientId=world.client)[0])

    whole = float(np.hypot(0.3, 0.1)) / 0.5
    world.advance(ON + whole / 2)
    assert place() == pytest.approx([0.2, 0.45, 0.15], abs=0.01)
    world.advance(2.0)
    assert place() == pytest.approx([0.2, 0.3, 0.2], abs=1e-6)
    assert p.getBaseVelocity(body, physicsClientId=world.client)[0] == (0.0, 0.0, 0.0)


def test_a_world_with_an_ended_fault_of_software_is_as_without(make: Make) -> None:
    world = make("planning_finds_nothing")
    plain = make("camera_dark", camera="wrist", on=100.0)
    for one in (world, plain):
        drive(one, "right", np.array(one.cell.known.arm("right").sleep) + 0.2, 1.0)
    assert np.array_equal(world.arms["right"].tool_pose().as_matrix(), plain.arms["right"].tool_pose().as_matrix())
    [fault] = world.faults
    assert fault.began_at == pytest.approx(ON, abs=0.01)
    assert fault.ended_at == pytest.approx(OFF, abs=0.02)
