import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from app.pose_both import merged, run_both
from app.pose_scenes import study_cell
from app.pose_trial import Setup
from perception.estimate import Estimate, pose_covariance

X = np.array([1.0, 0.0, 0.0])


def estimate(x: float, turn_deg: float, deviation: float, angle: float) -> Estimate:
    axis = Rotation.from_euler("z", turn_deg, degrees=True).apply(X)
    pose = RigidTransform.from_translation([x, 0.0, 0.0])
    covariance = pose_covariance(axis, deviation, angle)
    return Estimate(0.0, "rear", pose.translation, axis, pose, covariance, 100, 100, 0.09, True)


def test_looks_are_weighed_by_their_covariance_and_not_by_their_frames() -> None:
    sure, unsure = estimate(0.0, 0.0, 0.001, 0.01), estimate(0.010, 11.0, 0.002, 0.03)
    found = merged([[sure], [unsure] * 40])
    assert found.translation == pytest.approx([0.002, 0.0, 0.0])  # variances 1 : 4
    axis = found.rotation.apply(X)
    assert np.rad2deg(np.arctan2(axis[1], axis[0])) == pytest.approx(1.1, abs=0.02)  # 1 : 9


def test_the_surer_look_says_which_end_is_which() -> None:
    found = merged([[estimate(0.0, 180.0, 0.001, 0.03)], [estimate(0.0, 2.0, 0.001, 0.01)]])
    assert found.rotation.apply(X) @ X > 0.99


def test_the_wrist_camera_helps_where_the_rear_camera_sees_a_part() -> None:
    (trial,) = run_both(Setup(study_cell(), ["rgbd"], grasps=False), "4", 0)
    assert trial.technique == "rgbd, both cameras"
    assert (trial.identified, trial.why) == (True, "")
    assert trial.error_m is not None
    assert trial.error_m < 0.03  # the rear camera alone sees the tip's face: 33 to 46 mm
