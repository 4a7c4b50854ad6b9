"""The tag technique on real renders."""

from collections.abc import Iterator
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation
from scipy.stats import chi2
from tag_scene import CONNECTOR, EYE, KNOWN, TAG, K, TagScene, facing, random_pose

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.frame import RgbdFrame
from regrasp.perception.camera.calibration import undistorted
from regrasp.perception.camera.model import project
from regrasp.perception.pose import fiducial
from regrasp.perception.pose.estimate import Estimate, NoEstimate
from regrasp.perception.pose.fiducial import Fiducial, FiducialParameters, TagPose, find_tag
from regrasp.perception.pose.segmentation import NotSeen
from regrasp.perception.pose.technique import make_technique

MIDDLE = np.array([0.05, -0.04, 0.75])
BESIDE = np.array([-0.2, 0.1, 0.9])
NOISE = FiducialParameters().corner_noise


@pytest.fixture(scope="module")
def scene() -> Iterator[TagScene]:
    made = TagScene()
    yield made
    made.close()


def found(frame: RgbdFrame, near: NDArray[np.float64] | None = None) -> TagPose:
    result = find_tag(frame, TAG, near)
    assert isinstance(result, TagPose), result
    return result


def between(found: RigidTransform, true: RigidTransform) -> NDArray[np.float64]:
    """What leads from the true pose to the one found (6,): m, rad."""
    return np.concatenate([found.translation - true.translation, (found.rotation * true.rotation.inv()).as_rotvec()])


def mahalanobis_sq(error: NDArray[np.float64], covariance: NDArray[np.float64]) -> float:
    """Squared Mahalanobis distance."""
    return float(error @ np.linalg.solve(covariance, error))


def test_free_views_are_found_and_the_covariance_tells_how_well() -> None:
    scene, rng = TagScene(), np.random.default_rng(4)
    poses = [random_pose(rng)[0] for _ in range(60)]
    seen = [find_tag(scene.frame(pose, number=i), TAG) for i, pose in enumerate(poses)]
    scene.close()
    errors = [
        (between(s.pose, pose), s.covariance) for s, pose in zip(seen, poses, strict=True) if isinstance(s, TagPose)
    ]
    assert len(errors) >= 57
    distances = np.array([np.linalg.norm(error[:3]) for error, _ in errors])
    assert np.median(distances) < 0.003
    assert np.percentile(distances, 95) < 0.012
    for part, limit in ((slice(0, 3), chi2.ppf(0.95, 3)), (slice(3, 6), chi2.ppf(0.95, 3))):
        inside = [mahalanobis_sq(error[part], covariance[part, part]) < limit for error, covariance in errors]
        assert np.mean(inside) > 0.85


@settings(max_examples=40)
@given(
    slant=st.floats(0.0, 1.0),
    towards=st.floats(-np.pi, np.pi),
    roll=st.floats(-np.pi, np.pi),
    distance=st.floats(0.35, 0.9),
    number=st.integers(1, 1000),
)
def test_no_pose_is_far_off_and_said_to_be_near(
    scene: TagScene, slant: float, towards: float, roll: float, distance: float, number: int
) -> None:
    true = facing(distance * np.array([0.1, -0.1, 1.0]), slant, towards, roll)
    result = find_tag(scene.frame(true, number=number), TAG)
    if isinstance(result, TagPose):
        error = between(result.pose, true)
        assert np.linalg.norm(error[:3]) < 0.005 + 8.0 * np.sqrt(np.trace(result.covariance[:3, :3]))
        assert np.linalg.norm(error[3:]) < 0.05 + 8.0 * np.sqrt(np.trace(result.covariance[3:, 3:]))
        assert np.linalg.eigvalsh(result.covariance).min() > 0


def test_without_depth_two_poses_remain_and_depth_settles_which(scene: TagScene) -> None:
    """Far away and a little slanted, the mirrored pose explains the corners nearly as well."""
    doubts: dict[str, list[float]] = {"blind": [], "deep": []}
    tilts: dict[str, list[float]] = {"blind": [], "deep": []}
    for towards in np.linspace(-3.0, 3.0, 12):
        frame = scene.frame(facing(np.array([0.0, 0.0, 0.9]), np.deg2rad(14.0), towards, 0.4), number=7)
        for name, shown in (("deep", frame), ("blind", replace(frame, depth=np.zeros_like(frame.depth)))):
            result = found(shown)
            doubts[name].append(result.ambiguity)
            tilts[name].append(float(np.sqrt(np.trace(result.covariance[3:, 3:]))))
    assert np.mean(np.array(doubts["blind"]) > 0.05) > 0.3
    assert np.mean(doubts["deep"]) < 0.5 * np.mean(doubts["blind"])
    assert np.mean(tilts["deep"]) < np.mean(tilts["blind"])


def test_a_frontal_tag_leaves_its_tilt_open(scene: TagScene) -> None:
    frontal = found(scene.frame(facing(MIDDLE, 0.0, 0.0, 0.3)))
    slanting = found(scene.frame(facing(MIDDLE, 0.7, 0.5, 0.3)))
    wide, narrow = (np.sqrt(np.trace(r.covariance[3:, 3:])) for r in (frontal, slanting))
    assert wide > 3 * narrow


def test_the_estimate_is_of_the_whole_connector_in_the_world(scene: TagScene, known: CableKnown) -> None:
    world_from_camera = KNOWN.camera("rear").mount.world_from_camera  # type: ignore[union-attr]
    true = facing(MIDDLE, 0.5, 1.0, 0.2)
    technique = make_technique("fiducial", KNOWN)
    result = technique.estimate(scene.frame(true), world_from_camera)
    assert isinstance(result, Estimate)
    there = world_from_camera * true
    assert np.linalg.norm(result.position - there.translation) < 0.008
    assert result.axis @ there.rotation.apply([1.0, 0.0, 0.0]) > np.cos(np.deg2rad(3.0))
    assert result.whole
    assert result.extent == CONNECTOR.length
    # A camera pose known to 2 mm and 3 mrad makes at least so much of the position's error.
    assert np.linalg.eigvalsh(result.covariance[:3, :3]).min() > 0.002**2
    other_way = technique.estimate(scene.frame(true), world_from_camera, axis=-result.axis)
    assert isinstance(other_way, Estimate)
    np.testing.assert_array_equal(other_way.axis, result.axis)  # the tag tells the ends apart
    with pytest.raises(ValueError, match="no tag"):
        Fiducial(known)


def test_the_clips_tag_gives_its_seat() -> None:
    clip = KNOWN.cable.clip
    assert clip.tag is not None
    scene = TagScene(tags=[clip.tag])
    true = facing(MIDDLE, 0.4, 0.5, 0.2, clip.tag)
    seat = Fiducial(KNOWN).seat(scene.frame(true), EYE)
    missing = Fiducial(KNOWN).estimate(scene.frame(true), EYE)
    scene.close()
    assert isinstance(seat, TagPose)
    assert np.linalg.norm(seat.pose.translation - true.translation) < 4 * np.sqrt(np.trace(seat.covariance[:3, :3]))
    assert isinstance(missing, NoEstimate)  # the clip's is not the connector's
    assert (missing.reason, missing.message) == (NotSeen.NO_TAG, "no tag 7 in the picture")


def test_of_two_alike_the_one_near_the_last_place_is_taken() -> None:
    scene = TagScene(tags=[TAG, TAG])
    near, far = facing(MIDDLE, 0.4, 0.5, 0.2), facing(BESIDE, 0.4, 0.5, 0.2)
    frame = scene.frame(near, far)
    scene.close()
    for hint, true in ((None, near), (near.translation, near), (far.translation, far)):
        assert np.linalg.norm(between(found(frame, hint).pose, true)[:3]) < 0.015


def test_a_hidden_a_cut_or_a_turned_tag_is_not_seen(scene: TagScene) -> None:
    true = facing(MIDDLE, 0.4, 0.5, 0.2)
    frame = scene.frame(true)
    u, v = project((true * TAG.body_from_tag).translation[None], K)[0].astype(int)
    half = frame.rgb.copy()
    half[:, u:] = (110, 60, 140)
    away = true * TAG.body_from_tag * RigidTransform.from_rotation(Rotation.from_euler("y", np.pi))
    edge = facing(np.array([-0.475, 0.0, 0.75]), 0.2, 0.5, 0.2)
    for rgb in (half, scene.frame(away * TAG.body_from_tag.inv()).rgb, scene.frame(edge).rgb):
        result = find_tag(replace(frame, rgb=rgb), TAG)
        assert isinstance(result, NoEstimate)
        assert result.reason is NotSeen.NO_TAG
    assert v > 0


def test_size_and_depth_that_disagree_give_no_pose(scene: TagScene) -> None:
    frame = scene.frame(facing(MIDDLE, 0.4, 0.5, 0.2))
    wrong_lens = replace(frame, intrinsics=replace(K, fx=1.3 * K.fx, fy=1.3 * K.fy))
    for shown in (wrong_lens, replace(frame, depth=1.15 * frame.depth)):
        result = find_tag(shown, TAG)
        assert isinstance(result, NoEstimate)
        assert result.reason is NotSeen.WRONG_SIZE
        assert "by its size" in result.message


@settings(max_examples=30)
@given(
    fill=st.sampled_from([0.0, np.nan, np.inf, -1.0, 1e-6, 100.0]),
    share=st.floats(0.0, 1.0),
    light=st.sampled_from([0.0, 0.02, 0.3, 3.0, 1000.0]),
    seed=st.integers(0, 1000),
)
def test_spoilt_frames_give_a_reason_or_a_pose_that_holds(
    scene: TagScene, fill: float, share: float, light: float, seed: int
) -> None:
    true = facing(MIDDLE, 0.4, 0.5, 0.2)
    frame = scene.frame(true)
    depth = frame.depth.copy()
    depth[np.random.default_rng(seed).random(depth.shape) < share] = fill
    rgb = np.clip(light * frame.rgb.astype(float), 0, 255).astype(np.uint8)
    result = find_tag(replace(frame, rgb=rgb, depth=depth), TAG)
    if isinstance(result, TagPose):
        assert mahalanobis_sq(between(result.pose, true), result.covariance) < 60.0
        assert np.isfinite(result.covariance).all()


def test_a_bent_picture_made_straight_gives_the_pose(scene: TagScene) -> None:
    lens, true = [-0.3, 0.1, 0.0, 0.0, 0.0], facing(np.array([0.3, -0.15, 0.7]), 0.4, 0.5, 0.2)
    frame = scene.frame(true)
    matrix = np.array([[K.fx, 0.0, K.cx], [0.0, K.fy, K.cy], [0.0, 0.0, 1.0]])
    pixels = (
        np.stack(np.meshgrid(np.arange(K.width), np.arange(K.height)), axis=-1).reshape(-1, 1, 2).astype(np.float32)
    )
    source = cv2.undistortPoints(pixels, matrix, np.array(lens), P=matrix).reshape(K.height, K.width, 2)
    rgb, depth = (cv2.remap(image, source, None, cv2.INTER_LINEAR) for image in (frame.rgb, frame.depth))
    bent = replace(frame, rgb=rgb, depth=depth)
    straight = replace(frame, rgb=undistorted(rgb, K, lens), depth=undistorted(depth, K, lens))
    errors = []
    for shown in (bent, straight):
        result = find_tag(shown, TAG)
        errors.append(np.linalg.norm(between(result.pose, true)[:3]) if isinstance(result, TagPose) else np.inf)
    assert errors[0] > 0.015
    assert errors[1] < 0.008


def test_noise_alone_is_no_tag() -> None:
    rng = np.random.default_rng(0)
    depth = np.full((K.height, K.width), 0.75, np.float32)
    for _ in range(5):
        rgb = rng.integers(0, 256, (K.height, K.width, 3), np.uint8)
        assert isinstance(find_tag(RgbdFrame("rear", 1, 0.0, rgb, depth, K), TAG), NoEstimate)


def test_the_covariance_follows_the_corners_noise(scene: TagScene) -> None:
    """Against many draws of the corners: the linear share of the covariance is theirs."""
    true = facing(MIDDLE, 0.7, 0.5, 0.2)
    half = TAG.size / 2
    square = (true * TAG.body_from_tag).apply([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])
    corners, rng, errors = project(square, K), np.random.default_rng(2), []
    for _ in range(400):
        solved = fiducial._solve(corners + rng.normal(0, NOISE, (4, 2)), TAG, K, NOISE)
        assert solved is not None
        poses, _, _ = solved
        both = [between(pose * TAG.body_from_tag.inv(), true) for pose in poses]
        errors.append(min(both, key=lambda error: float(np.linalg.norm(error[3:]))))
    drawn = np.cov(np.array(errors).T)
    told = fiducial._covariance(square, true.translation, K, FiducialParameters())
    np.testing.assert_allclose(np.sqrt(np.diag(told)), np.sqrt(np.diag(drawn)), rtol=0.2)


def test_an_exact_square_has_one_pose() -> None:
    """OpenCV's second is not a number then."""
    solved = fiducial._solve(np.array([[397.5, 152.5], [425.5, 152.5], [425.5, 180.5], [397.5, 180.5]]), TAG, K, NOISE)
    assert solved is not None
    assert np.isfinite(solved[1]).all()
    assert solved[1][0, :, 2].mean() == pytest.approx(TAG.size * K.fx / 28.0, rel=0.01)
