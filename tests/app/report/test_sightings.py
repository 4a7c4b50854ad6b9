"""Where what the robot saw is drawn in its pictures."""

import numpy as np
import pytest

from regrasp.app.report.sightings import joint_motion
from regrasp.motion.robots.kinematics import ArmKinematics


def test_the_links_stand_where_the_kinematics_has_them(right_arm: ArmKinematics) -> None:
    q = np.linspace(-0.5, 0.7, len(right_arm))
    frames = right_arm.link_frames(q)
    for joint, position in enumerate(q):
        assert frames[joint] @ joint_motion(right_arm.chain, joint, position) == pytest.approx(frames[joint + 1])
