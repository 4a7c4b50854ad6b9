import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from regrasp.app.tasks.cable.studies.pose.grasp import grasp, services_of
from regrasp.app.tasks.cable.studies.pose.scenes import StudyScene, study_cell
from regrasp.interfaces.cell import pose_along

SMALL = [f"known.cameras.{i}.{key}={size}" for i in (0, 1) for key, size in (("width", 212), ("height", 120))]


def believed(scene: StudyScene, off: float = 0.0) -> RigidTransform:
    """The true pose with another roll, raised by `off` m."""
    pose = scene.truth.connector_pose()
    x, y, z = pose.translation.tolist()
    ax, ay, az = pose.rotation.apply([1.0, 0.0, 0.0]).tolist()
    return pose_along((x, y, z + off), (ax, ay, az))


@pytest.mark.parametrize("name", ["2", pytest.param("4", marks=pytest.mark.slow), "9"])
def test_the_right_pose_is_grasped(name: str) -> None:
    with StudyScene(study_cell(overrides=SMALL), name, 0) as scene:
        assert grasp(scene, services_of(scene), believed(scene)) == ""
        assert scene.truth.held()
        assert not scene.truth.plugged()  # drawn off the stand
        assert not scene.truth.contact_peaks()  # it saw the piece before the ninth


def test_an_arm_that_is_far_off_sees_itself_and_takes_hold() -> None:
    """By its encoders alone the jaw closed beside the connector."""
    with StudyScene(study_cell(), "5", 525) as scene:
        services = services_of(scene)
        assert grasp(scene, services, believed(scene)) == ""
        arm = scene.world.arms["right"]
        off = services.motion.tool("right").inv().apply(arm.tool_pose().translation)
        assert float(np.linalg.norm(off)) > 0.012
        assert not scene.truth.contact_peaks()


def test_a_wrong_pose_is_not_grasped() -> None:
    with StudyScene(study_cell(overrides=SMALL), "2", 0) as scene:
        assert grasp(scene, services_of(scene), believed(scene, 0.05)).startswith(
            "grasp_empty: the jaw closed on nothing"
        )
        assert scene.truth.plugged()


def test_a_pose_out_of_reach_is_said() -> None:
    with StudyScene(study_cell(overrides=SMALL), "2", 0) as scene:
        away = RigidTransform.from_translation([0.6, 0.6, 0.9]) * believed(scene)
        assert grasp(scene, services_of(scene), away).startswith("out_of_reach: ")
