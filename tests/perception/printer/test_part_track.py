"""The hand's own fingers, the section and its motion, by rendered pictures of the habitat with all its errors."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from regrasp.app.files.resources import shipped
from regrasp.app.scenario.cell_file import load_cell
from regrasp.app.tasks.printer.studies.hand_placed import HandPlaced
from regrasp.interfaces.printer.cell import PrinterCell
from regrasp.interfaces.printer.target import TargetEstimate
from regrasp.perception.printer.hand_view import HandView, Pads
from regrasp.perception.printer.part_track import PartTracker, line_through
from regrasp.perception.printer.section_view import NoSection, SectionSighting, SectionView


def the_cell(**printer: Any) -> PrinterCell:
    cell = load_cell(shipped("cell")["habitat_open"])
    assert isinstance(cell, PrinterCell)
    hidden = cell.hidden.model_copy(update={"printer": cell.hidden.printer.model_copy(update=printer)})
    return cell.model_copy(update={"hidden": hidden})


@pytest.fixture
def hand() -> Iterator[HandPlaced]:
    with HandPlaced(the_cell(), 3) as placed:
        yield placed


def before(hand: HandPlaced, x: float, y: float = 0.0, z: float = 0.0) -> RigidTransform:
    return RigidTransform.from_translation([x, y, z]) * hand.goal


def view_of(hand: HandPlaced) -> HandView:
    motion: Any = hand.services.motion
    frame = hand.picture()
    view = HandView(motion.tool_at(frame).inv() * motion.camera_pose(frame), pads_of(hand))
    view.feed(frame, hand.arm.gripper.reading().gap)
    return view


def true_front(hand: HandPlaced) -> Any:
    return (hand.tool().inv() * hand.world.objects.part.front()).translation


def tracker_of(hand: HandPlaced) -> PartTracker:
    services: Any = hand.services
    tracker = services.perception.part_tracker(services.motion.tool_at, lambda: hand.arm.gripper.reading().gap, 0.0)
    assert isinstance(tracker, PartTracker)
    return tracker


@pytest.mark.parametrize("seed", [1, 3, 4])
def test_relative_to_the_fingers_the_section_is_seen_to_two_millimeters(seed: int) -> None:
    """The mount of the camera is off by up to 6 mm, and the depth by up to 3 %."""
    with HandPlaced(the_cell(), seed) as hand:
        hand.place(before(hand, 0.02))
        view, sight = view_of(hand), SectionView(the_cell().known.printer.part)
        frame = hand.picture()
        measured, as_known = (sight.find(frame, mount) for mount in (view.camera_from_tool, _without(view)))
        assert isinstance(measured, SectionSighting)
        assert isinstance(as_known, SectionSighting)
        off, off_as_known = (float(np.linalg.norm(s.front - true_front(hand))) for s in (measured, as_known))
        assert off < 0.002
        assert off < off_as_known
        assert measured.yaw == pytest.approx(0.0, abs=np.deg2rad(1.0))


def _without(view: HandView) -> Any:
    mount = view.camera_from_tool
    mount[:3, 3] -= view.offset
    return mount


def pads_of(hand: HandPlaced) -> Pads:
    pads = Pads.of(hand.world.cell.known.arm("arm").robot)
    assert pads is not None
    return pads


@pytest.mark.parametrize("gap", [0.04, 0.06])
def test_a_jaw_that_stands_otherwise_open_tells_the_same(gap: float) -> None:
    offsets = []
    for opening in (0.05, gap):
        with HandPlaced(the_cell(), 3, gap=opening) as hand:
            hand.place(before(hand, 0.2))
            hand.world.advance(1.0)
            offsets.append(view_of(hand).offset)
    assert offsets[0] == pytest.approx(offsets[1], abs=1.2e-3)
    assert np.linalg.norm(offsets[0]) > 3e-3


def test_pads_of_unknown_size_are_not_looked_for() -> None:
    robot = load_cell(shipped("cell")["habitat"]).known.arm("arm").robot
    gripper = robot.gripper.model_copy(update={"length": None})
    assert Pads.of(robot.model_copy(update={"gripper": gripper})) is None


def test_a_part_that_is_turned_and_elsewhere() -> None:
    cell = the_cell(part_off=(0.01, 0.02), part_yaw_deg=12.0)
    with HandPlaced(cell, 5) as hand:
        nominal: Any = hand.services.motion
        hand.place(RigidTransform.from_translation([0.1, 0.02, 0.0]) * nominal.part_goal(0.02))
        view = view_of(hand)
        seen = SectionView(cell.known.printer.part).find(hand.picture(), view.camera_from_tool)
        assert isinstance(seen, SectionSighting)
        assert np.rad2deg(seen.yaw) == pytest.approx(12.0, abs=1.5)
        assert float(np.linalg.norm(seen.front - true_front(hand))) < 0.004  # 0.26 m from the camera; depth is off


def test_a_section_without_depth_is_placed_by_how_wide_it_looks(hand: HandPlaced) -> None:
    hand.place(before(hand, 0.2))
    view, frame = view_of(hand), hand.picture()
    frame.depth[:] = 0.0
    seen = SectionView(the_cell().known.printer.part).find(frame, view.camera_from_tool)
    assert isinstance(seen, SectionSighting)
    assert float(np.linalg.norm(seen.front - true_front(hand))) < 0.02
    assert seen.deviation > 0.003
    assert seen.yaw_deviation > 0.1


def test_a_picture_without_the_part_says_what_is_missing(hand: HandPlaced) -> None:
    hand.place(before(hand, 0.2))
    hand.world.objects.part.take_away()
    tracker = tracker_of(hand)
    hand.picture()
    assert tracker.update() is None
    assert "0 pixels have its colour" in tracker.why


def test_no_section_where_there_is_no_color(hand: HandPlaced) -> None:
    frame = hand.picture()
    frame.rgb[:] = 128
    assert isinstance(SectionView(the_cell().known.printer.part).find(frame, np.eye(4)), NoSection)


def test_a_part_that_drifts_is_known_to_drift(hand: HandPlaced) -> None:
    hand.place(before(hand, 0.15))
    tracker, velocity = tracker_of(hand), np.array([0.0, 0.012, 0.016])
    hand.world.objects.part.float_off(velocity)
    for _ in range(40):
        hand.world.advance(0.05)
        seen = tracker.update()
    assert seen is not None
    assert seen.velocity == pytest.approx(velocity, abs=0.004)
    assert seen.deviation < 0.001


def test_a_part_that_is_knocked_is_tracked_anew(hand: HandPlaced) -> None:
    hand.place(before(hand, 0.15))
    tracker = tracker_of(hand)
    for _ in range(10):
        hand.world.advance(0.05)
        first = tracker.update()
    for share in np.linspace(0.1, 1.0, 10):
        hand.world.objects.part.slide(np.array([0.0, 0.03 * share, 0.0]))
        hand.world.advance(0.02)
    for _ in range(10):
        hand.world.advance(0.05)
        last = tracker.update()
    assert first is not None
    assert last is not None
    assert (last.pose - first.pose)[:3, 3] == pytest.approx([0.0, 0.03, 0.0], abs=0.002)


def test_a_part_that_goes_fast_is_known_to_go_fast(hand: HandPlaced) -> None:
    hand.place(before(hand, 0.35))
    tracker = tracker_of(hand)
    for _ in range(10):
        hand.world.advance(0.05)
        tracker.update()
    hand.world.objects.part.float_off(np.array([0.0, -0.3, 0.0]))
    speeds = []
    for _ in range(12):
        hand.world.advance(0.05)
        seen = tracker.update()
        assert seen is not None
        speeds.append(float(np.linalg.norm(seen.velocity)))
    assert max(speeds) == pytest.approx(0.3, abs=0.08)


def test_a_line_through_estimates_gives_place_and_velocity() -> None:
    noise = np.random.default_rng(1).normal(0.0, 1e-4, (30, 3))
    estimates = []
    for stamp, off in zip(np.arange(30) / 20.0, noise, strict=True):
        pose = np.eye(4)
        pose[:3, 3] = np.add([0.1, 0.2, 0.3 + 0.002 * stamp], off)
        estimates.append(TargetEstimate(float(stamp), pose, np.zeros(3), 1e-3, 1e-2))
    place, velocity = line_through(estimates)
    assert place == pytest.approx([0.1, 0.2, 0.3029], abs=2e-4)
    assert velocity == pytest.approx([0.0, 0.0, 0.002], abs=2e-4)


def test_a_camera_that_freezes_does_not_make_the_part_run_before_the_hand() -> None:
    with HandPlaced(the_cell(), 1) as hand:
        hand.place(before(hand, 0.12))
        tracker = tracker_of(hand)
        for _ in range(5):
            hand.picture()
            seen = tracker.update()
        assert seen is not None
        hand.world.cameras["hand"].frozen = True
        for x in (0.112, 0.104, 0.096):
            hand.place(before(hand, x))
            hand.world.advance(0.035)  # a picture
            seen = tracker.update()
            assert seen is not None
            assert np.linalg.norm(seen.velocity) < 0.01  # m/s
