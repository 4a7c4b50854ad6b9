from dataclasses import dataclass, replace

import numpy as np
import pytest
from raycast import BLACK, PURPLE, REAR_POSE, WOOD, Block, Cylinder, Sensor, render
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cell import KnownCell, MappedRegion
from regrasp.interfaces.frame import Intrinsics, RgbdFrame
from regrasp.perception.cable.service import CablePerception
from regrasp.perception.mapping.occupancy import Spheres, Voxel
from regrasp.perception.pose.estimate import Estimate, NoEstimate
from regrasp.perception.service import Perception

PLACE = np.array([0.36, 0.02, 0.30])
AXIS = np.array([0.1, 1.0, 0.1]) / np.sqrt(1.02)
CABLE = Cylinder(PLACE - 0.095 * AXIS, AXIS, 0.1, 0.0035, BLACK)
END = Cylinder(PLACE, AXIS)
WALL = Block(np.array([0.508, -0.4572, 0.0]), np.array([0.521, 0.4572, 0.6096]), WOOD)
FLOOR = Block(np.array([-1.0, -1.2, -0.04]), np.array([1.4, 1.2, 0.0]), WOOD)
FOAM = Block(np.array([0.22, 0.15, 0.10]), np.array([0.30, 0.27, 0.28]), PURPLE)
REAR = Intrinsics.from_fov(848, 480, float(np.deg2rad(65.0)))
Thing = Cylinder | Block


def seen(*things: Thing, scale: float = 0.0) -> RgbdFrame:
    return render([WALL, FLOOR, *things, *([CABLE] if END in things else [])], REAR_POSE, REAR, Sensor(scale=scale), 5)


@dataclass
class Eye:
    """A camera whose newest frame is set by hand."""

    name: str = "rear"
    frame: RgbdFrame | None = None

    def latest(self) -> RgbdFrame | None:
        return self.frame

    def show(self, frame: RgbdFrame, number: int, stamp: float) -> None:
        self.frame = replace(frame, number=number, stamp=stamp)


class Clock:
    def now(self) -> float:
        return 0.0


def believed(_frame: RgbdFrame) -> RigidTransform:
    return REAR_POSE


def perception(known: CableKnown, eye: Eye, arm: list[Spheres] | None = None) -> CablePerception:
    return CablePerception(known, {"rear": eye}, Clock(), believed, lambda: arm or [])


def test_there_is_nothing_to_say_before_the_first_frame(known: CableKnown) -> None:
    eyes = perception(known, Eye())
    assert eyes.frame("rear") is None
    assert eyes.look("rear") is None
    assert eyes.map_obstacles("rear") == 0


def test_a_frame_is_estimated_once_and_tells_the_track_once(known: CableKnown) -> None:
    eye = Eye()
    eyes = perception(known, eye)
    fed = []
    feed = eyes.track.feed
    eyes.track.feed = lambda result: (fed.append(result), feed(result))[1]  # type: ignore[method-assign, func-returns-value]
    eye.show(seen(END), number=1, stamp=0.0)
    first = eyes.look("rear")
    assert isinstance(first, Estimate)
    assert eyes.look("rear") is first
    eye.show(seen(END), number=2, stamp=1 / 15)
    second = eyes.look("rear")
    assert isinstance(second, Estimate)
    assert second is not first
    assert fed == [first, second]
    assert eyes.track.last is second


def test_a_look_finds_the_connector_in_the_world(known: CableKnown) -> None:
    eye = Eye()
    eye.show(seen(END), number=1, stamp=0.0)
    found = perception(known, eye).look("rear")
    assert isinstance(found, Estimate)
    assert found.position == pytest.approx(PLACE, abs=0.006)


def test_an_empty_scene_gives_a_reason_and_no_position(known: CableKnown) -> None:
    eye = Eye()
    eyes = perception(known, eye)
    eye.show(seen(), number=1, stamp=0.0)
    assert isinstance(eyes.look("rear"), NoEstimate)
    assert eyes.track.last is None


def test_a_wrong_depth_scale_moves_no_obstacle(known: CableKnown) -> None:
    eye = Eye()
    eye.show(seen(FOAM, scale=0.03), number=1, stamp=0.0)
    eyes = perception(known, eye)
    eyes.map_obstacles("rear")
    front = float(np.median(eyes.occupancy.occupied_points(Voxel.SURFACE)[:, 0]))
    assert front == pytest.approx(FOAM.lower[0], abs=0.010)  # uncorrected 0.018 behind


def test_a_cell_may_say_where_obstacles_are_mapped(known: CableKnown) -> None:
    eye = Eye()
    eye.show(seen(FOAM), number=1, stamp=0.0)
    middle = float(0.5 * (FOAM.lower[1] + FOAM.upper[1]))
    half = known.model_copy(update={"mapped": MappedRegion(lower=(0.16, middle, 0.01), upper=(0.5, 0.44, 0.62))})
    eyes = perception(half, eye)
    assert eyes.map_obstacles("rear") > 0
    assert float(eyes.occupancy.occupied_points()[:, 1].min()) > middle


def test_a_surface_is_seen_where_it_is_in_the_next_picture(known: CableKnown) -> None:
    eye = Eye()
    eyes = perception(known, eye)
    assert eyes.surface("rear", 0.0) is None
    eye.show(seen(FOAM, scale=0.03), number=1, stamp=0.0)
    assert eyes.surface("rear", 0.01) is None  # an older picture may show something else
    points = eyes.surface("rear", 0.0)
    assert points is not None
    front = points[np.linalg.norm(points - FOAM.lower - (0.0, 0.05, 0.08), axis=1) < 0.03]
    assert len(front) > 300
    assert float(np.median(front[:, 0])) == pytest.approx(FOAM.lower[0], abs=0.004)  # uncorrected 0.018 behind


def test_nothing_is_seen_by_a_camera_in_trouble(known: CableKnown) -> None:
    eye = Eye()
    eyes = perception(known, eye)
    blank = replace(seen(FOAM), depth=np.zeros((480, 848), np.float32))
    for number in range(3):
        eye.show(replace(blank, rgb=np.zeros_like(blank.rgb)), number=number, stamp=0.0)
        eyes.trouble("rear")
    points = eyes.surface("rear", 0.0)
    assert points is not None
    assert points.shape == (0, 3)


def test_an_obstacle_is_mapped_and_an_arm_is_not(known: CableKnown) -> None:
    eye = Eye()
    eye.show(seen(FOAM), number=1, stamp=0.0)
    eyes = perception(known, eye)
    assert eyes.map_obstacles("rear") > 100
    points = eyes.occupancy.occupied_points()
    off = np.linalg.norm(np.maximum(np.maximum(FOAM.lower - points, points - FOAM.upper), 0.0), axis=1)
    assert off.max() < 0.05  # by depth noise, pixels, voxel and the assumed depth
    assert np.quantile(off, 0.95) < 0.03
    middle = (FOAM.lower + FOAM.upper) / 2
    arm = perception(known, eye, [(middle[None], np.array([0.15]))])
    assert arm.map_obstacles("rear") < 0.05 * len(points)


def test_a_second_look_changes_the_map_only_for_a_new_thing(known: CableKnown) -> None:
    eye, sensor = Eye(), Sensor(scale=0.0)
    eyes = perception(known, eye)
    eye.show(seen(FOAM), number=1, stamp=0.0)
    eyes.map_obstacles("rear")
    mapped = eyes.occupancy.occupied_points()
    eye.show(render([WALL, FLOOR, FOAM], REAR_POSE, REAR, sensor, 6), number=2, stamp=0.1)  # other noise
    assert eyes.map_new_obstacle("rear") == 0
    assert np.array_equal(eyes.occupancy.occupied_points(), mapped)
    edges = np.array([0.0, 0.015, 0.015])  # as noise and the camera's error move them
    eye.show(seen(Block(FOAM.lower - edges, FOAM.upper + edges)), number=3, stamp=0.15)
    assert eyes.map_new_obstacle("rear") == 0
    assert np.array_equal(eyes.occupancy.occupied_points(), mapped)
    aside = np.array([0.0, 0.25, 0.0])
    eye.show(seen(FOAM, Block(FOAM.lower + aside, FOAM.upper + aside)), number=4, stamp=0.2)
    assert eyes.map_new_obstacle("rear") > 80
    assert len(eyes.occupancy.occupied_points()) > len(mapped) + 80


def test_without_a_task_the_connector_is_an_obstacle_like_another(known: CableKnown) -> None:
    cell = KnownCell(boxes=known.boxes, arms=known.arms, cameras=known.cameras, latencies=known.latencies)
    eye = Eye()
    eye.show(seen(replace(END, radius=0.03)), number=1, stamp=0.0)
    eyes = Perception(cell, {"rear": eye}, Clock(), believed, list)
    assert eyes.fixed_cameras == ("rear",)
    found = eyes.look_around()
    points, edge, unseen, _ = eyes.obstacles()
    assert len(points) + len(unseen) == found
    assert np.linalg.norm(points - PLACE, axis=1).min() < 0.04
    assert edge == eyes.parameters.region.voxel
    spared = perception(known, eye)
    spared.look_around()
    assert len(spared.obstacles()[0]) < found


def test_only_frames_from_its_beginning_on_tell_of_stillness(known: CableKnown) -> None:
    eye = Eye()
    watch = perception(known, eye).watch_stillness("rear")
    assert watch.still() is None
    frame = seen(END)
    for number in range(-3, 16):
        eye.show(frame, number=number, stamp=number / 15)
        told = watch.still()
        assert told is (True if number == 15 else None)


def test_beside_a_connector_that_was_looked_at_a_guess_is_no_obstacle_and_a_surface_is(known: CableKnown) -> None:
    eye = Eye()
    eye.show(seen(FOAM), number=1, stamp=0.0)
    eyes = perception(known, eye)
    eyes.look_around()
    mapped = eyes.obstacles()
    behind = RigidTransform.from_translation(np.add(FOAM.lower, [0.06, 0.06, 0.09]))
    beside = eyes.obstacles_beside(behind)
    assert np.array_equal(beside.points, mapped.points)
    assert beside.spacing == mapped.spacing
    gone = {tuple(p) for p in mapped.unseen.tolist()} - {tuple(p) for p in beside.unseen.tolist()}
    assert gone
    half = 0.5 * known.cable.connector.length
    assert all(np.linalg.norm(np.array(p) - behind.translation) < 0.05 + half for p in gone)


def test_a_connector_in_the_clip_is_stowed(known: CableKnown) -> None:
    eye = Eye()
    eye.show(seen(END), number=1, stamp=0.0)
    eyes = perception(known, eye)
    found = eyes.look("rear")
    assert isinstance(found, Estimate)
    assert not eyes.stowed(found).detected
    seat = np.array(known.cable.clip.seat)
    assert eyes.stowed(replace(found, position=np.add(seat, [0.0, 0.0, 0.03]))).detected
    assert eyes.slipped(RigidTransform.identity()) is None  # one frame alone does not show a camera that lives
