"""Fusion of estimates: properties that hold for any estimates, and how often the stated regions hold the truth."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from scipy.spatial.transform import RigidTransform, Rotation
from scipy.stats import chi2

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import pose_along
from regrasp.perception.pose.estimate import ROLL_VARIANCE, Estimate, pose_covariance
from regrasp.perception.pose.fusion import FusionParameters, fuse

PLACE, LEFT = np.array([0.4, 0.1, 0.3]), np.array([0.0, 1.0, 0.0])
SEEDS = st.integers(0, 2**32 - 1)
COMMON, FAR = FusionParameters().common_share, FusionParameters().max_mahalanobis_sq


def estimate(
    position: FloatArray = PLACE,
    axis: FloatArray = LEFT,
    camera: str = "rear",
    covariance: FloatArray | None = None,
    extent: float = 0.09,
    whole: bool = True,
    sign_seen: bool = False,
) -> Estimate:
    x, y, z = position.tolist()
    ax, ay, az = axis.tolist()
    pose = pose_along((x, y, z), (ax, ay, az))
    covariance = pose_covariance(axis, 0.003, 0.05) if covariance is None else covariance
    return Estimate(0.0, camera, position, axis, pose, covariance, 500, 600, extent, whole, sign_seen)


def across(axis: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.svd(axis[None])[2][1:])


def random_covariance(rng: np.random.Generator, axis: FloatArray, scale: float = 1.0) -> FloatArray:
    """Of a pose of which the turn about the axis is not known."""
    root = rng.normal(size=(5, 5)) + 2.0 * np.eye(5)
    spread = np.zeros((6, 5))
    spread[:3, :3], spread[3:, 3:] = 0.002 * np.eye(3), 0.02 * across(axis).T
    out = scale**2 * spread @ root @ root.T @ spread.T
    out[3:, 3:] += ROLL_VARIANCE * np.outer(axis, axis)
    return np.asarray(out)


def draws(seed: int, cameras: Sequence[str]) -> list[Estimate]:
    """An estimate for each camera named, with errors drawn from its own covariance."""
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    return [draw(rng, axis, random_covariance(rng, axis), camera) for camera in cameras]


def draw(
    rng: np.random.Generator, axis: FloatArray, covariance: FloatArray, camera: str, common: FloatArray | None = None
) -> Estimate:
    """An estimate of the connector at `PLACE`; `common` (6,) is the error that it shares with others."""
    root = np.linalg.cholesky(covariance)
    own = root @ rng.normal(size=6)
    error = own if common is None else np.sqrt(COMMON) * root @ common + np.sqrt(1.0 - COMMON) * own
    tilt = Rotation.from_rotvec(across(axis).T @ across(axis) @ error[3:])
    carried = np.eye(6)
    carried[3:, 3:] = tilt.as_matrix()  # the turn of which nothing is known is about the axis that was found
    return estimate(PLACE + error[:3], tilt.apply(axis), camera, carried @ covariance @ carried.T)


def turn_covariance(e: Estimate) -> FloatArray:
    return np.asarray(across(e.axis) @ e.covariance[3:, 3:] @ across(e.axis).T)


def contradiction(one: Estimate, other: Estimate) -> float:
    """The squared Mahalanobis length of what is between their places and, as if it were small, between their axes."""
    spread = np.zeros((5, 6))
    spread[:3, :3], spread[3:, 3:] = np.eye(3), across(one.axis)
    away = spread @ np.concatenate([other.position - one.position, np.cross(one.axis, other.axis)])
    return float(away @ np.linalg.solve(spread @ (one.covariance + other.covariance) @ spread.T, away))


def alike(one: Estimate, other: Estimate) -> None:
    assert one.position == pytest.approx(other.position, abs=1e-6)
    assert one.axis == pytest.approx(other.axis, abs=1e-6)
    assert one.covariance == pytest.approx(other.covariance, rel=1e-5, abs=1e-9)


@given(SEEDS, st.lists(st.sampled_from(["rear", "wrist"]), min_size=2, max_size=7), st.randoms())
def test_the_order_of_the_estimates_does_not_matter(seed: int, cameras: list[str], random: object) -> None:
    estimates = draws(seed, cameras)
    shuffled = list(estimates)
    random.shuffle(shuffled)  # type: ignore[attr-defined]
    alike(fuse(estimates), fuse(shuffled))


@given(SEEDS)
def test_one_estimate_stays_what_it_is(seed: int) -> None:
    (only,) = draws(seed, ["rear"])
    fused = fuse([only])
    alike(fused, only)
    assert fused.world_from_connector.rotation.as_matrix() == pytest.approx(
        only.world_from_connector.rotation.as_matrix(), abs=1e-7
    )


@given(SEEDS)
def test_where_the_world_frame_lies_does_not_matter(seed: int) -> None:
    estimates = draws(seed, ["rear", "rear", "rear", "wrist"])
    assume(all(np.linalg.cond(e.covariance) < 1e9 for e in estimates))  # else digits are lost, not the frame
    move = RigidTransform.from_components([1.0, -2.0, 0.5], Rotation.random(rng=seed))
    turn = np.kron(np.eye(2), move.rotation.as_matrix())
    moved = [
        replace(
            e,
            position=move.apply(e.position),
            axis=move.rotation.apply(e.axis),
            world_from_connector=move * e.world_from_connector,
            covariance=turn @ e.covariance @ turn.T,
        )
        for e in estimates
    ]
    here, there = fuse(estimates), fuse(moved)
    assert there.position == pytest.approx(move.apply(here.position), abs=1e-6)
    assert there.axis == pytest.approx(move.rotation.apply(here.axis), abs=1e-6)
    assert there.covariance == pytest.approx(turn @ here.covariance @ turn.T, rel=1e-5, abs=1e-8)


@given(st.integers(2, 40))
def test_frames_of_one_camera_leave_what_they_have_in_common(count: int) -> None:
    one = estimate()
    fused = fuse([one] * count)
    share = COMMON + (1.0 - COMMON) / count
    assert fused.covariance[:3, :3] == pytest.approx(share * one.covariance[:3, :3])
    assert turn_covariance(fused) == pytest.approx(share * turn_covariance(one))
    assert fused.axis @ fused.covariance[3:, 3:] @ fused.axis == pytest.approx(ROLL_VARIANCE)


@given(SEEDS)
@example(53)  # they contradict each other by their axes, though not by their places
def test_a_second_camera_only_makes_it_surer_if_they_agree(seed: int) -> None:
    rear, wrist = draws(seed, ["rear", "wrist"])
    assume(contradiction(rear, wrist) < 0.8 * FAR)  # of the others see below
    both = fuse([rear, wrist])
    for alone in (rear, wrist):
        assert np.trace(both.covariance[:3, :3]) < 1.02 * np.trace(alone.covariance[:3, :3])


def test_a_camera_that_sees_along_the_axis_is_helped_by_one_that_sees_it_from_the_side() -> None:
    def seen(camera: str, axis: FloatArray, sharp: tuple[float, float, float]) -> Estimate:
        covariance = pose_covariance(LEFT, 0.01, 0.03)
        covariance[:3, :3] = np.diag(np.square(sharp))
        return estimate(PLACE + 0.5 * np.array(sharp), axis, camera, covariance)

    fused = fuse([seen("rear", LEFT, (0.02, 0.001, 0.001)), seen("wrist", LEFT, (0.001, 0.02, 0.001))])
    assert np.linalg.norm(fused.position - PLACE) < 0.0015
    assert np.sqrt(np.diag(fused.covariance)[:3]).max() < 0.0011
    assert fused.camera == "rear, wrist"


def test_many_frames_of_a_worse_camera_do_not_outweigh_a_better_one() -> None:
    away = np.array([0.0, 0.006, 0.0])
    sure = estimate(covariance=pose_covariance(LEFT, 0.001, 0.01))
    unsure = estimate(PLACE + away, LEFT, "wrist", pose_covariance(LEFT, 0.002, 0.03))
    fused = fuse([sure] + [unsure] * 40)
    assert fused.position == pytest.approx(PLACE + 0.24 * away, abs=1e-4)  # variances 1 and 4 times 0.8


@pytest.mark.parametrize("cameras", [("rear",), ("rear", "wrist")])
@pytest.mark.parametrize("frames", [1, 2, pytest.param(12, marks=pytest.mark.slow)])
def test_the_truth_lies_in_the_stated_regions_as_often_as_they_say(cameras: tuple[str, ...], frames: int) -> None:
    rng = np.random.default_rng(frames)
    axis = np.array([0.6, 0.0, 0.8])
    inside = []
    for _ in range(400):
        estimates = []
        for camera in cameras:
            covariance, common = random_covariance(rng, axis), rng.normal(size=6)
            scales = rng.uniform(0.7, 1.5, frames) ** 2
            estimates += [draw(rng, axis, scale * covariance, camera, common) for scale in scales]
        fused = fuse(estimates)
        miss = np.concatenate([PLACE - fused.position, across(axis) @ np.cross(fused.axis, axis)])
        spread = np.zeros((5, 6))
        spread[:3, :3], spread[3:, 3:] = np.eye(3), across(axis)
        inside.append(miss @ np.linalg.solve(spread @ fused.covariance @ spread.T, miss) < chi2.ppf(0.95, 5))
    assert 0.91 < np.mean(inside) < 0.99


@given(SEEDS, st.integers(4, 9))  # of three right ones, one draw in 1,500 sides with the false one
def test_one_false_find_moves_nothing(seed: int, count: int) -> None:
    right = draws(seed, ["rear"] * count)
    false = replace(right[0], position=np.add(PLACE, [0.3, 0.0, 0.0]))
    assert fuse([*right, false]).position == pytest.approx(fuse(right).position, abs=0.02)


def test_two_that_contradict_each_other_are_not_trusted() -> None:
    for cameras in (("rear", "rear"), ("rear", "wrist")):
        fused = fuse([estimate(PLACE, LEFT, cameras[0]), estimate(np.add(PLACE, [0.1, 0.0, 0.0]), LEFT, cameras[1])])
        assert np.sqrt(fused.covariance[0, 0]) > 0.045


def test_parts_do_not_count_beside_a_look_at_the_whole() -> None:
    part = estimate(np.add(PLACE, [0.0, 0.03, 0.0]), extent=0.03, whole=False)
    fused = fuse([part, part, part, estimate()])
    assert fused.whole
    assert fused.position == pytest.approx(PLACE)


def test_of_parts_alone_the_longest_count_and_are_not_the_whole() -> None:
    stub = estimate(np.add(PLACE, [0.0, 0.04, 0.0]), np.array([1.0, 0.0, 0.0]), extent=0.02, whole=False)
    fused = fuse([stub, stub, stub, estimate(extent=0.06, whole=False)])
    assert not fused.whole
    assert fused.position == pytest.approx(PLACE)
    assert fused.axis == pytest.approx(LEFT)


def test_those_that_saw_the_cable_settle_which_end_is_which() -> None:
    guessed, seen = estimate(axis=-LEFT), estimate(sign_seen=True)
    assert fuse([guessed] * 5 + [seen]).axis == pytest.approx(LEFT)
    assert fuse([seen, seen, estimate(axis=-LEFT, sign_seen=True)]).axis == pytest.approx(LEFT)
    assert fuse([guessed, guessed, estimate()]).axis == pytest.approx(-LEFT)
    x_axis = fuse([guessed] * 5 + [seen]).world_from_connector.rotation.apply([1.0, 0.0, 0.0])
    assert x_axis == pytest.approx(LEFT)


def test_a_tag_that_tells_the_roll_gives_it() -> None:
    sure = 1e-4 * np.eye(6)
    rolled = RigidTransform.from_components(PLACE, Rotation.from_euler("zx", [np.pi / 2, 0.7]))
    tag = replace(estimate(camera="wrist", covariance=sure), world_from_connector=rolled)
    fused = fuse([estimate(), tag])
    assert (fused.world_from_connector.rotation * rolled.rotation.inv()).magnitude() < 0.01
    assert fused.axis @ fused.covariance[3:, 3:] @ fused.axis == pytest.approx(1e-4)


def test_no_estimate_is_no_fusion() -> None:
    with pytest.raises(ValueError, match="no estimate"):
        fuse([])


@pytest.mark.parametrize("apart", [0.001, 0.01, 0.075, 0.187])
def test_frames_that_disagree_across_the_view_do_not_meet_in_the_camera(apart: float) -> None:
    """Each is sure across its ray and unsure along it: their weighted mean would lie where the rays meet."""
    places = [np.array([offset, 0.0, 0.83]) for offset in (0.0, apart)]
    estimates = []
    for place in places:
        ray = place / np.linalg.norm(place)
        covariance = pose_covariance(LEFT, 0.0002, 0.05)
        covariance[:3, :3] += 0.0128**2 * np.outer(ray, ray)
        estimates.append(estimate(place, covariance=covariance))
    fused = fuse(estimates)
    assert 0.82 < fused.position[2] < 0.84
    for place in places:
        away = fused.position - place
        assert away @ np.linalg.solve(fused.covariance[:3, :3], away) < 9.0


def test_the_limit_of_outliers_is_a_quantile_of_chi_square() -> None:
    assert FusionParameters().max_mahalanobis_sq == pytest.approx(float(chi2.ppf(0.999, 5)), rel=1e-12)
