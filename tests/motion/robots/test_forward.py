import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.motion.robots.forward import ANY_AXIS, link_frames_in


def test_a_joint_may_turn_about_any_axis() -> None:
    rng = np.random.default_rng(0)
    base = RigidTransform.from_components([0.1, 0.2, -0.3], Rotation.random(rng=rng))
    for _ in range(20):
        axis, origin, angle = rng.normal(size=3), rng.normal(size=3), rng.uniform(-3, 3)
        axis /= np.linalg.norm(axis)
        joints = np.array([[*origin, *axis, ANY_AXIS, 1.0, -np.pi, np.pi]])
        link = base * RigidTransform.from_components(origin, Rotation.from_rotvec(angle * axis))
        frames = link_frames_in(np.ascontiguousarray(base.as_matrix()), joints, np.array([angle]))
        np.testing.assert_allclose(frames[1], link.as_matrix(), atol=1e-12)
