"""The thesis's RGB-D technique: the connector's pose from its colour and depth (Hwang 2024, section 3.2.3)."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cell import KnownCell
from regrasp.interfaces.frame import RgbdFrame
from regrasp.perception.camera.model import deproject
from regrasp.perception.pose.estimate import LEFT, Estimate, NoEstimate, pose_covariance
from regrasp.perception.pose.segmentation import NoSegment, NotSeen, SegmentationParameters, segment

FloatArray = NDArray[np.float64]

MIN_POINTS = 20  # choice: n-mean and min/max need distinct points
MIDDLE_SHARE = 0.2  # choice: n for the position is a fifth of the points: averages noise and stays in the middle
END_SHARE = 0.05  # choice: n for each end is a twentieth: 70 points at 0.75 m; more would shorten the vector
# Of position and axis, root mean square over the thesis's nine configurations: the chain cannot tell a hidden part.
POSITION_DEVIATION, ANGLE_DEVIATION = 0.012, 0.3  # m each axis, rad
DEVIATIONS = 2.0  # choice: an even spread ends at 1.73 standard deviations, so 2 cuts outliers and no ends


class Rgbd:
    """A `Technique`. It knows the connector's colour; its largest patch is the connector."""

    def __init__(self, known: KnownCell) -> None:
        self._parameters = SegmentationParameters.for_color(known.connector.color)
        self._length = known.connector.length

    def estimate(
        self,
        frame: RgbdFrame,
        world_from_camera: RigidTransform,
        *,
        axis: FloatArray | None = None,
        near: FloatArray | None = None,
    ) -> Estimate | NoEstimate:
        """See `Technique.estimate`. The position is the visible part's, the roll the camera's, as in the thesis."""
        found = segment(frame.rgb, self._parameters)
        if isinstance(found, NoSegment):
            return NoEstimate(frame.stamp, frame.camera, found.reason, found.message)
        cloud = deproject(frame.depth, found.mask, frame.intrinsics, found.corner)
        points = without_outliers(cloud) if len(cloud) >= MIN_POINTS else cloud
        if len(points) < MIN_POINTS:
            message = f"{len(points)} depth readings on {found.area} pixels of the connector, {MIN_POINTS} are needed"
            return NoEstimate(frame.stamp, frame.camera, NotSeen.NO_DEPTH, message)
        here = min_max_axis(points)
        along = np.sort(points @ here)
        extent = float(along[int(0.99 * len(along))] - along[int(0.01 * len(along))])
        pose = seen_pose(n_mean(points), here, world_from_camera, LEFT if axis is None else axis)
        position, way = pose.translation, pose.as_matrix()[:3, 0]
        too_long = extent - self._length  # what shows more than the connector is that much in doubt
        spread = pose_covariance(way, max(POSITION_DEVIATION, too_long), ANGLE_DEVIATION)
        return Estimate(
            frame.stamp,
            frame.camera,
            position,
            way,
            pose,
            spread,
            len(points),
            found.area,
            extent,
            whole=False,
        )


def without_outliers(points: FloatArray) -> FloatArray:
    """Those of `points` (n, 3) that lie within `DEVIATIONS` standard deviations of the mean along every axis."""
    square = (points - points.mean(axis=0)) ** 2
    u, v, w = (square <= DEVIATIONS**2 * square.mean(axis=0) + 1e-18).T
    return np.asarray(points[u & v & w])


def n_mean(points: FloatArray) -> FloatArray:
    """Per axis, the mean of the n middle values of `points` (m, 3); (3,). n is `MIDDLE_SHARE` of m."""
    n = max(1, round(MIDDLE_SHARE * len(points)))
    start = (len(points) - n) // 2
    return np.asarray(np.partition(points, (start, start + n - 1), axis=0)[start : start + n].mean(axis=0))


def min_max_axis(points: FloatArray) -> FloatArray:
    """Unit vector (3,) from the mean of the n lowest to that of the n highest of `points` (m, 3), optical frame.

    Lowest and highest along image x or y, whichever lie further apart; n is `END_SHARE` of m.
    """
    n = max(1, round(END_SHARE * len(points)))
    spreads, vectors = [], []
    for k in (0, 1):
        order = np.argpartition(points[:, k], (n, len(points) - n))
        vectors.append(points[order[-n:]].mean(axis=0) - points[order[:n]].mean(axis=0))
        spreads.append(vectors[k][k])
    vector = vectors[int(np.argmax(spreads))]
    return np.asarray(vector / np.linalg.norm(vector))


def seen_pose(
    center: FloatArray, axis: FloatArray, world_from_camera: RigidTransform, hint: FloatArray
) -> RigidTransform:
    """world_from_connector of a `center` (3,) and a unit `axis` (3,) in the optical frame.

    The axis points where `hint` (3,), world, does; z is as near as can be to the camera's up (forward if up aligns).
    Plain arithmetic: scipy's transforms would take a third of the technique's time.
    """
    camera = world_from_camera.as_matrix()
    out = np.eye(4)
    out[:3, 3] = camera[:3, :3] @ center + camera[:3, 3]
    x = camera[:3, :3] @ axis
    x *= 1.0 if x @ hint >= 0 else -1.0
    up, forward = -camera[:3, 1], camera[:3, 2]
    z = up if abs(x @ up) < 0.95 else forward
    z = z - (z @ x) * x
    z /= np.sqrt(z @ z)
    out[:3, 0], out[:3, 1], out[:3, 2] = x, np.cross(z, x), z
    return RigidTransform(out, normalize=False)  # it is a rotation: to make it one would take as long again
