from regrasp.app.tasks.cable.studies.pose.both_cameras import run_both
from regrasp.app.tasks.cable.studies.pose.scenes import study_cell
from regrasp.app.tasks.cable.studies.pose.trial import Setup


def test_the_wrist_camera_helps_where_the_rear_camera_sees_a_part() -> None:
    (trial,) = run_both(Setup(study_cell(), ["rgbd"], grasps=False), "4", 0)
    assert trial.technique == "rgbd, both cameras"
    assert (trial.identified, trial.why) == (True, "")
    assert trial.error_m is not None
    assert trial.error_m < 0.03  # the rear camera alone sees the tip's face: 33 to 46 mm
