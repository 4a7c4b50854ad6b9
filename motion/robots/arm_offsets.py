"""By how much an arm's encoders are off, judged by what a camera sees of the arm.

Good for where the arm stands: many sets of six offsets explain one view, and it is the nearest to none that comes out.
"""

import numpy as np
from numpy.typing import NDArray

from regrasp.motion.robots.kinematics import AXES, ArmKinematics, FloatArray, world_spheres
from regrasp.motion.robots.spheres import LINKS, spheres_at

# The spheres enclose the arm: what a camera sees of it lies so far within them. This, and what follows, gave the least
# error of the tool on 51 pictures of 11 arms: 2.7 mm (at most 5.4) where encoders alone were 10 mm off (22).
WITHIN = 0.0055  # m
DEVIATION = 0.03  # rad, of an encoder's offset
NOISE = 0.015  # m, of a reading: an arm is no heap of spheres, and neighbouring readings are off together
GATES = (0.03, 0.021, 0.015, 0.010, *[0.008] * 8)  # m from the spheres: readings further off are of something else
NEAR = 0.06  # m from the spheres, to begin with: where a reading may come within the gates
MIN_READINGS = 300  # choice: a third of what shows of a hand beside a piece of foam
_FIRST_SEEN_LINK = 4  # the forearm beyond its roll: what is nearer to the shoulder errs in other ways than the hand


def joint_offsets(kin: ArmKinematics, q: FloatArray, opening: float, points: FloatArray) -> FloatArray:
    """What to add (6,) rad to the encoders' `q` (6,) so that the arm lies where its surface is seen; 0 if little is.

    `points` (n, 3) m, world: what a camera sees, of the arm and around it. `opening`: m between the pads.
    """
    seen = LINKS >= _FIRST_SEEN_LINK
    links, local = LINKS[seen], spheres_at(opening)[seen]
    local[:, 3] -= WITHIN
    points = points[_depths(points, world_spheres(kin.base, q, links, local))[0] < NEAR]
    offsets = np.zeros(6)
    for gate in GATES:
        spheres = world_spheres(kin.base, q + offsets, links, local)
        off, nearest = _depths(points, spheres)
        there = np.abs(off) < gate
        if np.count_nonzero(there) < MIN_READINGS:
            return np.zeros(6)
        slopes = _slopes(
            kin.link_frames(q + offsets), points[there], spheres[nearest[there], :3], links[nearest[there]]
        )
        info = np.eye(6) / DEVIATION**2 + slopes.T @ slopes / NOISE**2
        offsets -= np.linalg.solve(info, offsets / DEVIATION**2 + slopes.T @ off[there] / NOISE**2)
    return offsets


def _depths(points: FloatArray, spheres: FloatArray) -> tuple[FloatArray, NDArray[np.int64]]:
    """How far (n,) m points (n, 3) lie outside the nearest of the spheres (m, 4), and which (n,) that is."""
    outside = np.linalg.norm(points[:, None] - spheres[None, :, :3], axis=2) - spheres[:, 3]
    nearest = np.argmin(outside, axis=1)
    return outside[np.arange(len(points)), nearest], nearest


def _slopes(frames: FloatArray, points: FloatArray, centers: FloatArray, links: NDArray[np.int64]) -> FloatArray:
    """How a point's distance (m) to its sphere changes with each joint (rad), (n, 6), for link frames (7, 4, 4)."""
    away = points - centers
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    out = np.zeros((len(points), 6))
    for joint, axis in enumerate(AXES):
        frame = frames[joint + 1]
        turned = np.cross(frame[:3, axis], points - frame[:3, 3])
        out[:, joint] = np.where(links > joint, -np.einsum("ij,ij->i", away, turned), 0.0)
    return out
