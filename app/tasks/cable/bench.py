"""`make bench`: the time that our functions take against the bare library calls in them, measured in one process.

Then our planner against another one on a few queries of `regrasp study motion`, and where the time of whole runs goes.
"""

import io
import statistics
import time
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
import py_trees
from numpy.typing import NDArray
from py_trees.parsers.behaviour_tree_xml import parse_behaviour_tree_xml
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.app.campaigns.table import print_table
from regrasp.app.files.resources import shipped
from regrasp.app.run.attempts import Attempts
from regrasp.app.run.batch import Run, run_all
from regrasp.app.run.tick_log import TickLog
from regrasp.app.scenario.load import cases, load_scenario
from regrasp.app.studies.wall_parts import PARTS_HEADER, part_lines
from regrasp.app.tasks.cable.cells import cable_cell
from regrasp.app.tasks.cable.studies.demo import SCENARIOS
from regrasp.app.tasks.cable.studies.motion.study import run_motion
from regrasp.behaviors import LEAVES
from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.tag import TAG_DICTIONARY
from regrasp.perception.camera.color import SegmentationParameters, color_mask
from regrasp.perception.camera.registration import FIXED_CAMERA_ERRORS, register
from regrasp.perception.detection import letterboxed
from regrasp.perception.pose.detector import (
    NETWORK_HEIGHT,
    NETWORK_WIDTH,
    Detector,
    network_input,
    pixel_sizes,
    shipped_network,
)
from regrasp.perception.pose.estimate import NoEstimate
from regrasp.perception.pose.fused.fused import Fused
from regrasp.perception.pose.rgbd import Rgbd
from regrasp.perception.pose.technique import make_technique
from regrasp.sim.cable.cable import spring_torques
from regrasp.sim.cable.objects import cable_world
from regrasp.sim.render.renderer import make_renderer
from regrasp.sim.world import World
from regrasp.trees import check_tree
from regrasp.trees.scripted import ScriptedTree

Call = Callable[[], Any]


def print_bench() -> None:
    """Print a table: milliseconds of our call and of the other, and their ratio."""
    cv2.setNumThreads(1)  # as on a robot, whose other cores have other work
    scenario = load_scenario("no_obstacle")
    cell = scenario.cell
    assert isinstance(cell, CableCell)
    world = cable_world(cell, "zero", 0)
    try:
        rows = {
            "shipped trees checked / parsed by py_trees": tree_checks(),
            "tick of the recovery tree with logs / bare": tree_ticks(),
            "cable torques by numba / numpy and scipy": cable_torques(cell.hidden.cable.links),
            "848x480 picture by our renderer / OpenGL": rendering_speed(world),
            **color_techniques(cell, 848),
            **color_techniques(cell, 640),
            "848x480 tag to pose / bare OpenCV calls": tag_techniques(848),
            "640x480 tag to pose / bare OpenCV calls": tag_techniques(640),
            **detector_stages(cell, 848),
            **detector_stages(cell, 640),
        }
        print_table(
            ("pair", "ours ms", "other ms", "ratio"), [_line(name, *pair) for name, pair in rows.items() if pair]
        )
    finally:
        world.close()


def print_whole_runs() -> None:
    """Run the demonstration's six cases with two seeds, one after the other, and print where their time goes."""
    runs = [Run(case, seed) for name in SCENARIOS for case in cases(name, ()) for seed in (0, 1)]
    rows = [row for row in run_all(runs, jobs=1)[0].values() if row.wall_by_part]
    print_table(PARTS_HEADER, part_lines(rows))
    factor, longest = statistics.median(row.real_time_factor for row in rows), max(row.longest_tick for row in rows)
    step = statistics.median(1 + row.wall_by_part["step loop"] / row.wall_by_part["physics"] for row in rows)
    memory = max(row.peak_memory_mb for row in rows)
    print(f"step loop with its physics {step:.2f} x physics; whole runs {factor:.2f} x real time")
    print(f"longest tick {longest:.2f} s, peak memory {memory:.0f} MB")


def _line(name: str, ours: Call, other: Call) -> tuple[str, ...]:
    a, b = interleaved(ours, other)
    return name, f"{1e3 * a:.3f}", f"{1e3 * b:.3f}", f"{a / b:.2f}"


def interleaved(ours: Call, other: Call, seconds: float = 2.0) -> tuple[float, float]:
    """Median seconds of each call. They run in turn for `seconds`, at least five times, so that load hits both."""
    ours(), other()  # compiles, fills caches
    took: tuple[list[float], list[float]] = ([], [])
    end = time.perf_counter() + seconds
    while len(took[0]) < 5 or time.perf_counter() < end:
        for call, times in ((ours, took[0]), (other, took[1])):
            start = time.perf_counter()
            call()
            times.append(time.perf_counter() - start)
    return statistics.median(took[0]), statistics.median(took[1])


def tree_ticks() -> tuple[Call, Call]:
    """The recovery tree with scripted leaves, with and without logs: it loses, searches, stows, and starts again."""
    script = {"DetectSlip": "8 failure, running", "Carry": "20 success"}
    script |= {"Holding": "success, failure", "CheckCameras": "3 failure"}

    def tree() -> py_trees.trees.BehaviourTree:
        made = ScriptedTree(shipped("tree")["recovery"], script, default="5 success").tree
        made.visitors.clear()  # its tick table
        return made

    logged, bare = tree(), tree()
    logged.add_visitor(TickLog(logged.root, io.StringIO(), lambda: 0.0))
    logged.add_visitor(Attempts(logged.root, tuple, lambda: 0.0))
    return logged.tick, bare.tick


def tree_checks() -> tuple[Call, Call]:
    """All shipped trees: our full check, and py_trees' parser, which checks little."""
    paths = list(shipped("tree").values())

    def parse() -> None:
        for path in paths:
            parse_behaviour_tree_xml(str(path), node_registry=dict(LEAVES))
        py_trees.blackboard.Blackboard.clear()

    return lambda: [check_tree(path, LEAVES) for path in paths], parse


def cable_torques(links: int) -> tuple[Call, Call]:
    """The spring and damper torques of a bent cable with so many links."""
    rng = np.random.default_rng(0)
    rotations = Rotation.from_rotvec(0.1 * rng.normal(size=(links, 3))).as_quat(canonical=True)
    rates, stiffness, damping = rng.normal(size=(links, 3)), np.full(links, 2.0), np.full(links, 0.01)

    def plain() -> NDArray[np.float64]:
        turns = Rotation.from_quat(rotations).as_rotvec()
        return np.asarray(-stiffness[:, None] * turns - damping[:, None] * rates)

    states = np.hstack([rotations, rates])
    assert np.allclose(spring_torques(states, stiffness, damping), plain())
    return lambda: spring_torques(states, stiffness, damping), plain


def rendering_speed(world: World[Any]) -> tuple[Call, Call] | None:
    """The rear camera's picture by the software renderer and by OpenGL; None without EGL."""
    try:
        opengl = make_renderer(world.visuals, "moderngl")
    except Exception:  # moderngl and glcontext raise bare Exception
        return None
    spec = world.cell.known.camera("rear")
    pose = spec.mount.world_from_camera  # type: ignore[union-attr]

    def draw(renderer: Any) -> Any:
        return renderer.render(world.visuals.snapshot(), pose, spec.intrinsics, world.light)

    return lambda: draw(world.renderer), lambda: draw(opengl)


def rear_frame(cell: CableCell, width: int) -> tuple[RgbdFrame, RigidTransform]:
    """The rear camera's first frame with `width` x 480 pixels, and its nominal pose."""
    spec = cell.known.camera("rear").model_copy(update={"width": width})
    cameras = (spec, cell.known.camera("wrist"))
    wide = cell.known.model_copy(update={"cameras": cameras})
    world = cable_world(cell.model_copy(update={"known": wide}), "zero", 0)
    frame = world.cameras["rear"].latest()
    while frame is None:
        world.advance(0.05)
        frame = world.cameras["rear"].latest()
    world.close()
    return frame, spec.mount.world_from_camera  # type: ignore[union-attr]


def tag_techniques(width: int) -> tuple[Call, Call]:
    """The connector's pose by its tag in a rear frame of `width` x 480 pixels, and the bare OpenCV calls in it.

    These are the search for the tag, the fit of its edges, and its two poses.
    """
    cell = cable_cell("thesis_tags")
    frame, pose = rear_frame(cell, width)
    technique = make_technique("fiducial", cell.known)
    dictionary, fitting = (
        cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, TAG_DICTIONARY)),
        cv2.aruco.DetectorParameters(),
    )
    fitting.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_APRILTAG
    detector, fitter = cv2.aruco.ArucoDetector(dictionary), cv2.aruco.ArucoDetector(dictionary, fitting)
    square, camera = np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]]), np.diag([665.0, 665.0, 1.0])

    def bare() -> Any:
        gray = cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2GRAY)
        corners = next(c[0] for c, n in zip(*detector.detectMarkers(gray)[:2], strict=True) if n == 7)
        left, top, wide, high = cv2.boundingRect(corners)
        fitter.detectMarkers(
            cv2.resize(gray[top - 10 : top + high + 10, left - 10 : left + wide + 10], None, fx=2, fy=2)
        )
        both = cv2.solvePnPGeneric(square, corners.astype(float), camera, None, flags=cv2.SOLVEPNP_IPPE_SQUARE)
        return [
            cv2.solvePnPRefineLM(square, corners.astype(float), camera, None, *start)
            for start in zip(*both[1:3], strict=True)
        ]

    assert not isinstance(technique.estimate(frame, pose), NoEstimate)
    return lambda: technique.estimate(frame, pose), bare


def color_techniques(cell: CableCell, width: int) -> dict[str, tuple[Call, Call]]:
    """The connector's pose by its colour in a rear frame of `width` x 480 pixels, stages of it, and bare OpenCV calls.

    These are colour space, range, dilation and contours of the whole picture.
    """
    frame, pose = rear_frame(cell, width)
    known, color = cell.known, SegmentationParameters.for_color(cell.known.cable.connector.color)
    (code, *span), kernel = color.range(), np.ones((3, 3), np.uint8)

    def bare() -> Any:
        mask = cv2.dilate(cv2.inRange(cv2.cvtColor(frame.rgb, code), *span), kernel)
        return cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)

    rgbd, fused = Rgbd(known), Fused(known)
    unregistered = Fused(known.model_copy(update={"boxes": ()}))
    assert not any(isinstance(t.estimate(frame, pose), NoEstimate) for t in (rgbd, fused, unregistered))
    ours: dict[str, Call] = {
        "rgbd": lambda: rgbd.estimate(frame, pose),
        "fused": lambda: fused.estimate(frame, pose),
        "fused, the colour's mask": lambda: color_mask(frame.rgb, color),
        "fused, the camera registered": lambda: register(frame, pose, known.boxes, FIXED_CAMERA_ERRORS),
        "fused, all but registered": lambda: unregistered.estimate(frame, pose),
    }
    return {f"{width}x480 {name} / bare OpenCV calls": (call, bare) for name, call in ours.items()}


def detector_stages(cell: CableCell, width: int) -> dict[str, tuple[Call, Call]]:
    """The detector's pose from a rear frame of `width` x 480 pixels, its stages, and the network alone."""
    (frame, pose), detector = rear_frame(cell, width), Detector(cell.known)
    network = cv2.dnn.readNetFromONNX(np.frombuffer(shipped_network(), np.uint8))

    def make_input() -> Any:
        return network_input(
            letterboxed(frame.rgb, (NETWORK_HEIGHT, NETWORK_WIDTH))[0], pixel_sizes(frame.depth, frame.intrinsics)
        )[None]

    inputs = make_input()

    def bare() -> Any:
        network.setInput(inputs)
        return network.forward()

    assert not isinstance(detector.estimate(frame, pose), NoEstimate)
    ours: dict[str, Call] = {
        "detector": lambda: detector.estimate(frame, pose),
        "detector, its network's input": make_input,
        "detector, found but not placed": lambda: detector.detect(frame),
    }
    return {f"{width}x480 {name} / its network's bare forward": (call, bare) for name, call in ours.items()}


if __name__ == "__main__":
    print_bench()
    run_motion(range(12), jobs=1, out=None)
    print()
    print_whole_runs()
