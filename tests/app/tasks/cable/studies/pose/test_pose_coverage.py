from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.app.tasks.cable.studies.pose.coverage import (
    AXIS_LIMIT,
    POSITION_LIMIT,
    FrameCoverage,
    SceneCoverage,
    _write,
    coverage_figures,
    mahalanobis_sq,
    pose_errors,
)
from regrasp.perception.pose.estimate import ROLL_VARIANCE, Estimate

X = np.array([1.0, 0.0, 0.0])


def estimate(position: np.ndarray, axis: np.ndarray, covariance: np.ndarray) -> Estimate:
    pose = RigidTransform.from_translation(position)
    return Estimate(0.0, "rear", position, axis, pose, covariance, 100, 100, 0.09, True)


def test_honest_covariances_hold_the_truth_in_95_of_100() -> None:
    """Poses drawn from the very distribution that the covariance states, roll unknown."""
    rng = np.random.default_rng(0)
    truth = RigidTransform.from_components([0.3, 0.1, 0.3], Rotation.from_rotvec([0.3, -0.8, 1.9]))
    axis = truth.rotation.apply(X)
    root = np.linalg.qr(rng.normal(size=(5, 5)))[0] * [0.002, 0.004, 0.01, 0.02, 0.04]
    across = np.linalg.svd(axis[None])[2][1:]
    spread = np.zeros((6, 5))
    spread[:3], spread[3:] = root[:3], across.T @ root[3:]
    covariance = spread @ spread.T
    inside = np.zeros(2)
    for _ in range(4000):
        draw = spread @ rng.normal(size=5)
        turned = Rotation.from_rotvec(draw[3:]).apply(axis) * rng.choice([-1.0, 1.0])  # either end may lead
        told = covariance.copy()
        told[3:, 3:] += ROLL_VARIANCE * np.outer(turned, turned)
        found = mahalanobis_sq(estimate(truth.translation + draw[:3], turned, told), truth)
        inside += np.array(found) <= [POSITION_LIMIT, AXIS_LIMIT]
    np.testing.assert_allclose(inside / 4000, 0.95, atol=0.015)  # four standard deviations


def test_errors_by_hand() -> None:
    truth = RigidTransform.from_components([0.0, 0.0, 0.0], Rotation.identity())
    found = estimate(np.array([0.003, 0.0, 0.004]), -Rotation.from_euler("z", 10, degrees=True).apply(X), np.eye(6))
    assert pose_errors(found, truth) == pytest.approx((0.005, 10.0))
    assert mahalanobis_sq(found, truth) == pytest.approx((25e-6, np.deg2rad(10) ** 2))


def test_coverage_counts_each_techniques_own() -> None:
    covers = (FrameCoverage("a", "1", 0, 1.0, 1.0, 0.002, 1.0), FrameCoverage("a", "1", 0, 9.0, 5.0, 0.004, 3.0))
    found = coverage_figures("a", [SceneCoverage("a", 3, covers), SceneCoverage("b", 3, ())])
    assert (found["estimates"], found["position"], found["axis"]) == ([2, 3], [1, 2], [2, 2])
    assert found["mean_error_m"] == pytest.approx(0.003)
    assert found["by_configuration"] == {"1": {"position": [1, 2], "axis": [2, 2]}}
    assert coverage_figures("b", [SceneCoverage("b", 3, ())])["mean_error_m"] is None


def test_where_nothing_was_done_nothing_is_written(tmp_path: Path) -> None:
    _write(tmp_path / "out", [], ["fused"], range(1))
    assert not (tmp_path / "out").exists()
