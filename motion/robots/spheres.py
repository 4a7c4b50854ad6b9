"""The arm as spheres, for collision checks.

Computed from rtb-data's STL meshes of the ViperX 300 S by clustering surface points. Base, shoulder and fingers are
laid out by hand: small at the finger tips and where the arm comes near itself in its sleep pose. From the upper arm on
no mesh point lies more than 3 mm outside the spheres. The gripper's bar, which must pass between things, may stand out
5 mm. Fingers stand fully open, 0.057 m each, with pads 6 mm thick.
"""

import numba as nb
import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.arrays import FloatArray

# link frame (0 base ... 6 last link), centre x, y, z in that frame, radius; metres
_ROWS = [
    (0, 0.0000, 0.0000, -0.4580, 0.478),  # foot plate: the cap of a big sphere
    (2, 0.0018, -0.0392, 0.0198, 0.028),
    (2, -0.0017, 0.0416, 0.0229, 0.030),
    (2, 0.0006, -0.0144, 0.0509, 0.029),
    (2, 0.0021, 0.0126, 0.0515, 0.029),
    (2, -0.0006, 0.0003, 0.0986, 0.030),
    (2, 0.0003, 0.0000, 0.1375, 0.031),
    (2, -0.0034, -0.0012, 0.1821, 0.031),
    (2, 0.0003, 0.0011, 0.2242, 0.031),
    (2, 0.0065, -0.0004, 0.2685, 0.032),
    (2, 0.0178, -0.0250, 0.3004, 0.034),
    (2, 0.0560, -0.0222, 0.2983, 0.033),
    (2, 0.0122, 0.0267, 0.2999, 0.035),
    (2, 0.0514, 0.0273, 0.3003, 0.034),
    (3, 0.0230, -0.0309, 0.0006, 0.035),
    (3, 0.0629, -0.0006, -0.0017, 0.035),
    (3, 0.1168, -0.0008, 0.0034, 0.035),
    (3, 0.1703, 0.0005, -0.0001, 0.035),
    (3, 0.0251, 0.0330, -0.0007, 0.035),
    (4, 0.0593, -0.0127, -0.0001, 0.031),
    (4, 0.0151, -0.0005, -0.0007, 0.032),
    (4, 0.0986, -0.0004, -0.0001, 0.031),
    (4, 0.0594, 0.0181, -0.0004, 0.031),
    (4, 0.0243, 0.0321, -0.0002, 0.030),
    (5, 0.0209, -0.0274, 0.0021, 0.030),
    (5, 0.0186, 0.0268, 0.0032, 0.030),
    (5, 0.0549, 0.0003, 0.0053, 0.030),
    (5, 0.0497, -0.0006, 0.0237, 0.030),
    (6, 0.0199, -0.0006, 0.0002, 0.029),
    (6, 0.0217, 0.0001, 0.0213, 0.029),
    (6, 0.0446, -0.0183, -0.0164, 0.033),
    (6, 0.0476, 0.0191, -0.0173, 0.033),
    (6, 0.0567, -0.0540, -0.0016, 0.030),
    (6, 0.0566, 0.0540, -0.0002, 0.030),
    (6, 0.0474, 0.0229, 0.0097, 0.033),
    (6, 0.0494, -0.0189, 0.0159, 0.034),
]
_FINGER = [  # x, |y|, |z|, radius in the last link; mirrored in y and z
    (0.072, 0.0510, 0.0160, 0.0200),
    (0.090, 0.0495, 0.0160, 0.0190),
    (0.107, 0.0475, 0.0160, 0.0170),
    (0.119, 0.0455, 0.0170, 0.0125),
    (0.126, 0.0440, 0.0080, 0.0125),
]
_ROWS += [(0, 0.042 * np.cos(a), 0.042 * np.sin(a), 0.052, 0.038) for a in np.arange(8) * np.pi / 4]  # column
_ROWS += [(0, x, y, 0.024, 0.043) for x in (-0.170, -0.125, -0.085) for y in (-0.03, 0.03)]  # box behind the column
_ROWS += [(1, 0.0, y, z, 0.0255) for y in (-0.038, -0.012, 0.012, 0.038) for z in (0.018, 0.045)]  # yoke
_ROWS += [(6, x, sy * y, sz * z, r) for sy in (-1, 1) for x, y, z, r in _FINGER for sz in (-1, 1)]
_FINGERS = slice(len(_ROWS) - 4 * len(_FINGER), None)
JAW_OPENING = 0.075  # metres between the pads, 6 mm each, of fully open fingers

SPHERE_LINKS = np.array([row[0] for row in _ROWS], dtype=np.int64)  # (n,): the link whose frame a sphere is in
SPHERES = np.array([row[1:] for row in _ROWS], dtype=np.float64)  # (n, 4): centre and radius
# Three spheres cover a wrist camera: a RealSense measures 0.025 x 0.09 x 0.025 m.
CAMERA_RADIUS = 0.022  # metres
CAMERA_ACROSS = (-0.03, 0.0, 0.03)  # metres along the wrist link's y axis


def spheres_at(opening: float) -> NDArray[np.float64]:
    """`SPHERES` (n, 4), in their links' frames, with the pads `opening` metres apart."""
    moved = SPHERES.copy()
    moved[_FINGERS, 1] -= np.sign(moved[_FINGERS, 1]) * 0.5 * (JAW_OPENING - opening)
    return moved


@nb.njit(cache=True)  # type: ignore[untyped-decorator,unused-ignore]
def sphere_distances(points: FloatArray, spheres: FloatArray) -> tuple[FloatArray, NDArray[np.int64]]:
    """Signed distances (n,) m of points (n, 3) to the nearest of the spheres (m, 4), and which sphere (n,) that is."""
    distances, nearest = np.full(len(points), np.inf), np.zeros(len(points), np.int64)
    for n in range(len(points)):
        for m in range(len(spheres)):
            x, y, z = points[n, 0] - spheres[m, 0], points[n, 1] - spheres[m, 1], points[n, 2] - spheres[m, 2]
            distance = np.sqrt(x * x + y * y + z * z) - spheres[m, 3]
            if distance < distances[n]:
                distances[n], nearest[n] = distance, m
    return distances, nearest
