"""Joints along a tool's way: exact where the arm is well placed, and steady past a singularity of the wrist."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from regrasp.app.files.resources import shipped
from regrasp.app.scenario.cell_file import load_cell
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cause import CauseCode
from regrasp.motion.failure import PlanningError
from regrasp.motion.planning.following import followed
from regrasp.motion.printer.service import TO_THE_PRINTER
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.robots.poses import poses_between

GOAL = np.array([-0.495, 2.549, 1.51])
START_45_CE, START_BACK = np.array([0.45, 0.028, 0.041]), np.array([0.2, 0.0, 0.0])


@pytest.fixture(scope="module")
def kin() -> ArmKinematics:
    spec = load_cell(shipped("cell")["habitat"]).known.arm("arm")
    return ArmKinematics(spec.robot, spec.world_from_base)


def tool(place: FloatArray) -> FloatArray:
    return RigidTransform.from_components(place, TO_THE_PRINTER).as_matrix()


def ends(kin: ArmKinematics, offset: FloatArray) -> FloatArray:
    near = np.array([1.75, 0.0, -2.2, 2.3, -1.67, -1.57, 0.0])
    return kin.ik(tool(GOAL + offset), near)


def test_past_a_singularity_no_joint_turns_fast_and_the_tool_stays_near_its_line(kin: ArmKinematics) -> None:
    """From the source's start 45-CE with the wrist's other branch: it stands straight on the way."""
    passed = 0
    for q in ends(kin, START_45_CE):
        poses = poses_between(tool(GOAL + START_45_CE), tool(GOAL), 0.005, 0.05)
        try:
            path = followed(kin, q, np.concatenate([tool(GOAL + START_45_CE)[None], poses]))
        except PlanningError:
            continue
        least = [np.linalg.svd(kin.jacobian(p)[:, 1:], compute_uv=False)[-1] for p in path]
        assert np.abs(np.diff(path, axis=0)).max() < 0.1
        if least[-1] > 0.1:  # well placed at the end
            assert kin.tool_matrix(path[-1]) == pytest.approx(tool(GOAL), abs=1e-3)
            passed += min(least) < 0.02
    assert passed > 0


def test_a_way_out_of_reach_is_refused(kin: ArmKinematics) -> None:
    q = ends(kin, START_BACK)[0]
    poses = poses_between(tool(GOAL + START_BACK), tool(GOAL - 7.5 * START_BACK), 0.01, 0.05)
    with pytest.raises(PlanningError, match="cannot go straight on") as error:
        followed(kin, q, poses)
    assert error.value.code is CauseCode.OUT_OF_REACH
