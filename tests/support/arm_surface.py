"""What a camera would see of an arm that is made of spheres."""

import numpy as np
from numpy.typing import NDArray

from regrasp.motion.robots.arm_offsets import JointOffsetParameters
from regrasp.motion.robots.forward import spheres_in
from regrasp.motion.robots.kinematics import ArmKinematics

Floats = NDArray[np.float64]
DEPTH = JointOffsetParameters().surface_depth
EYE = np.array([-0.3, 0.5, 0.7])


def surface(kin: ArmKinematics, q: Floats, opening: float, spacing: float = 0.004) -> Floats:
    """Points (n, 3) of the arm's surface at `q` that face a camera at `EYE`, some `spacing` m apart."""
    body = kin.robot.body
    spheres = spheres_in(kin.link_frames(q), body.links, body.at(opening))
    steps = np.arange(2000) + 0.5
    height, turn = 1 - 2 * steps / len(steps), np.pi * (1 + 5**0.5) * steps  # a Fibonacci lattice
    flat = np.sqrt(1 - height**2)
    unit = np.column_stack([flat * np.cos(turn), flat * np.sin(turn), height])
    points = []
    for n, (x, y, z, r) in enumerate(spheres):
        radius = r - DEPTH
        mine = np.array([x, y, z]) + radius * unit[:: max(1, int(2000 * spacing**2 / (4 * np.pi * radius**2)))]
        others = np.delete(spheres, n, axis=0)
        bare = np.linalg.norm(mine[:, None] - others[None, :, :3], axis=2) > others[:, 3] - DEPTH
        points.append(mine[np.all(bare, axis=1) & (((mine - [x, y, z]) * (EYE - mine)).sum(axis=1) > 0)])
    return np.vstack(points)
