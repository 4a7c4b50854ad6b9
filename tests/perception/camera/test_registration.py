from dataclasses import replace

import numpy as np
import pytest
from raycast import PURPLE, REAR_POSE, Block, Sensor
from scene import PLACE, Thing, blocks, really, seen
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.frame import RgbdFrame
from regrasp.perception.camera.registration import (
    FIXED_CAMERA_ERRORS,
    WRIST_CAMERA_ERRORS,
    CameraErrors,
    Registration,
    register,
)

DRAWS = 30


def drawn(
    known: CableKnown, errors: CameraErrors, seed: int, others: list[Thing] | None = None
) -> tuple[RgbdFrame, RigidTransform, float]:
    """A frame of a camera with errors of that size, the camera's true pose and the factor that its depths need."""
    rng = np.random.default_rng(seed)
    camera, scale = really(REAR_POSE, errors, rng), rng.normal(0.0, errors.scale)
    frame = seen([*blocks(known.boxes), *(others or [])], PLACE, Sensor(scale=scale), seed, camera)
    return frame, camera, 1.0 / (1.0 + scale)


def miss(found: Registration, camera: RigidTransform, factor: float) -> np.ndarray:
    """By how much (3,) m a thing that stands at the work place is seen elsewhere."""
    reading = camera.inv().apply(PLACE) / factor
    return np.asarray(found.world_from_camera.apply(found.scale * reading) - PLACE)


@pytest.mark.parametrize(("errors", "mean"), [(FIXED_CAMERA_ERRORS, 0.002), (WRIST_CAMERA_ERRORS, 0.0035)])
def test_the_panels_bring_a_point_home(known: CableKnown, errors: CameraErrors, mean: float) -> None:
    untouched, corrected, inside = [], [], 0
    for seed in range(DRAWS):
        frame, camera, factor = drawn(known, errors, seed)
        before = register(frame, REAR_POSE, (), errors)
        after = register(frame, REAR_POSE, known.boxes, errors)
        untouched.append(np.linalg.norm(miss(before, camera, factor)))
        off = miss(after, camera, factor)
        corrected.append(np.linalg.norm(off))
        inside += bool(off @ np.linalg.solve(after.point_covariance(PLACE)[:3, :3], off) < 7.81)  # 95 % of chi2, 3
    assert np.mean(untouched) > 0.007
    assert np.mean(corrected) < mean
    assert inside >= 0.8 * DRAWS  # 95 % less the chance of so few draws


def test_arms_and_obstacles_before_the_panels_do_no_harm(known: CableKnown) -> None:
    things: list[Thing] = [
        Block(np.array([0.15, -0.3, 0.0]), np.array([0.22, -0.1, 0.5]), PURPLE),
        Block(np.array([0.44, 0.05, 0.25]), np.array([0.508, 0.4, 0.45]), PURPLE),  # stands on the panel
        Block(np.array([0.2, -0.05, 0.0]), np.array([0.5, 0.05, 0.03]), PURPLE),  # lies on the floor
    ]
    off = []
    for seed in range(10):
        frame, camera, factor = drawn(known, FIXED_CAMERA_ERRORS, seed, things)
        off.append(np.linalg.norm(miss(register(frame, REAR_POSE, known.boxes, FIXED_CAMERA_ERRORS), camera, factor)))
    assert np.mean(off) < 0.003


def test_a_thing_before_most_of_a_face_is_not_taken_for_it(known: CableKnown) -> None:
    piece = Block(np.array([0.25, -0.45, 0.0]), np.array([0.40, 0.30, 0.2]), PURPLE)  # its foot is near the floor
    for seed in range(5):
        frame, camera, factor = drawn(known, FIXED_CAMERA_ERRORS, seed, [piece])
        found = register(frame, REAR_POSE, known.boxes, FIXED_CAMERA_ERRORS)
        off = miss(found, camera, factor)
        assert off @ np.linalg.solve(found.point_covariance(PLACE)[:3, :3], off) < 11.3, (seed, off)  # 99 % of chi2, 3


def test_the_mahalanobis_distance_tells_a_camera_that_stands_elsewhere(known: CableKnown) -> None:
    for seed in range(5):
        frame, _, _ = drawn(known, FIXED_CAMERA_ERRORS, seed)
        assert register(frame, REAR_POSE, known.boxes, FIXED_CAMERA_ERRORS).mahalanobis_sq < 25
    moved = RigidTransform.from_translation([0.02, 0.0, 0.015]) * REAR_POSE
    assert register(frame, moved, known.boxes, FIXED_CAMERA_ERRORS).mahalanobis_sq > 40


def test_without_boxes_only_the_scale_stays_in_doubt(known: CableKnown) -> None:
    frame, _, _ = drawn(known, FIXED_CAMERA_ERRORS, 0)
    found = register(frame, REAR_POSE, (), FIXED_CAMERA_ERRORS)
    assert found.scale == 1.0
    np.testing.assert_array_equal(found.world_from_camera.as_matrix(), REAR_POSE.as_matrix())
    way = PLACE - REAR_POSE.translation
    expected = np.zeros((6, 6))
    expected[:3, :3] = FIXED_CAMERA_ERRORS.scale**2 * np.outer(way, way)
    np.testing.assert_allclose(found.point_covariance(PLACE), expected, atol=1e-15)


@pytest.mark.parametrize("nothing", [0.0, np.nan, np.inf, -1.0, 5.0])
def test_a_frame_that_shows_no_face_leaves_what_was_expected(known: CableKnown, nothing: float) -> None:
    frame, _, _ = drawn(known, FIXED_CAMERA_ERRORS, 0)
    blind = replace(frame, depth=np.full_like(frame.depth, nothing))
    found = register(blind, REAR_POSE, known.boxes, FIXED_CAMERA_ERRORS)
    assert found.scale == 1.0
    np.testing.assert_allclose(found.world_from_camera.as_matrix(), REAR_POSE.as_matrix(), atol=1e-12)
    spread = np.repeat(
        [FIXED_CAMERA_ERRORS.position, FIXED_CAMERA_ERRORS.rotation, FIXED_CAMERA_ERRORS.scale], [3, 3, 1]
    )
    np.testing.assert_allclose(found.covariance, np.diag(spread**2), rtol=1e-9, atol=1e-18)


def test_one_panel_alone_tells_no_shift_along_it(known: CableKnown) -> None:
    back = [box for box in known.boxes if box.name == "back_panel"]
    shifted = RigidTransform.from_components(REAR_POSE.translation + np.array([0.0, 0.004, 0.0]), REAR_POSE.rotation)
    frame = seen(blocks(back), PLACE, Sensor(), 0, shifted)
    found = register(frame, REAR_POSE, back, FIXED_CAMERA_ERRORS)
    deviation = np.sqrt(np.diag(found.covariance))
    assert deviation[1] > 0.9 * FIXED_CAMERA_ERRORS.position
    assert abs(found.world_from_camera.translation[1] - REAR_POSE.translation[1]) < 0.001


def test_a_carried_camera_may_be_turned_further(known: CableKnown) -> None:
    turned = Rotation.from_rotvec([0.012, -0.01, 0.015]) * REAR_POSE.rotation
    camera = RigidTransform.from_components(REAR_POSE.translation + np.array([0.006, -0.008, 0.005]), turned)
    frame = seen(blocks(known.boxes), PLACE, Sensor(), 0, camera)
    before = np.linalg.norm(miss(register(frame, REAR_POSE, (), WRIST_CAMERA_ERRORS), camera, 1.0))
    after = np.linalg.norm(miss(register(frame, REAR_POSE, known.boxes, WRIST_CAMERA_ERRORS), camera, 1.0))
    assert after < 0.004 < 0.012 < before
