"""The thesis's RGB-D technique: the connector's pose from its colour and depth (Hwang 2024, section 3.2.3)."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.frame import RgbdFrame
from regrasp.perception.camera.color import SegmentationParameters
from regrasp.perception.camera.model import deproject
from regrasp.perception.pose.estimate import DEFAULT_AXIS, Estimate, NoEstimate, pose_covariance
from regrasp.perception.pose.segmentation import NoSegment, NotSeen, segment


@dataclass(frozen=True)
class RgbdParameters:
    """How many points the means take, and how far off the result is."""

    min_points: int = 20  # choice: n-mean and min/max need distinct points
    outlier_deviations: float = 2.0  # choice: an even spread ends at 1.73 deviations: 2 cuts outliers, and no ends
    middle_share: float = 0.2  # of the points, for the position; choice: averages noise and stays in the middle
    end_share: float = 0.05  # of the points, for each end; choice: 70 at 0.75 m; more would shorten the vector
    # Root mean square errors over the thesis's nine configurations: the technique cannot tell a hidden part.
    position_deviation: float = 0.012  # m, each axis
    axis_deviation: float = 0.3  # rad


class Rgbd:
    """A `Technique`. It knows the connector's colour; the largest blob of it is the connector."""

    def __init__(self, known: CableKnown, parameters: RgbdParameters = RgbdParameters()) -> None:
        self._parameters = parameters
        self._color = SegmentationParameters.for_color(known.cable.connector.color)
        self._length = known.cable.connector.length

    def estimate(
        self,
        frame: RgbdFrame,
        world_from_camera: RigidTransform,
        *,
        axis: FloatArray | None = None,
        near: FloatArray | None = None,
    ) -> Estimate | NoEstimate:
        """See `Technique.estimate`. The position is the visible part's, the roll the camera's, as in the thesis."""
        found = segment(frame.rgb, self._color)
        if isinstance(found, NoSegment):
            return NoEstimate(frame.stamp, frame.camera, found.reason, found.message)
        cloud = deproject(frame.depth, found.mask, frame.intrinsics, found.corner)
        least = self._parameters.min_points
        points = without_outliers(cloud, self._parameters.outlier_deviations) if len(cloud) >= least else cloud
        if len(points) < least:
            message = f"{len(points)} depth readings on {found.area} pixels of the connector, {least} are needed"
            return NoEstimate(frame.stamp, frame.camera, NotSeen.NO_DEPTH, message)
        direction = min_max_axis(points, self._parameters.end_share)
        along = np.sort(points @ direction)
        extent = float(along[int(0.99 * len(along))] - along[int(0.01 * len(along))])
        center = n_mean(points, self._parameters.middle_share)
        pose = seen_pose(center, direction, world_from_camera, DEFAULT_AXIS if axis is None else axis)
        position, world_axis = pose.translation, pose.as_matrix()[:3, 0]
        too_long = extent - self._length  # a part that is longer than the connector makes the position so uncertain
        deviation = max(self._parameters.position_deviation, too_long)
        covariance = pose_covariance(world_axis, deviation, self._parameters.axis_deviation)
        return Estimate(
            frame.stamp,
            frame.camera,
            position,
            world_axis,
            pose,
            covariance,
            len(points),
            found.area,
            extent,
            whole=False,
            world_from_camera=world_from_camera,
        )


def without_outliers(points: FloatArray, deviations: float) -> FloatArray:
    """Those of `points` (n, 3) that lie within so many standard deviations of the mean along every axis."""
    square = (points - points.mean(axis=0)) ** 2
    u, v, w = (square <= deviations**2 * square.mean(axis=0) + 1e-18).T
    return np.asarray(points[u & v & w])


def n_mean(points: FloatArray, share: float) -> FloatArray:
    """Per axis, the mean of the n middle values of `points` (m, 3); (3,). n is this share of m."""
    n = max(1, round(share * len(points)))
    start = (len(points) - n) // 2
    return np.asarray(np.partition(points, (start, start + n - 1), axis=0)[start : start + n].mean(axis=0))


def min_max_axis(points: FloatArray, share: float) -> FloatArray:
    """Unit vector (3,) from the mean of the n lowest to that of the n highest of `points` (m, 3), optical frame.

    Lowest and highest along image x or y, whichever gives the longer distance; n is this share of m.
    """
    n = max(1, round(share * len(points)))
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
    """world_from_connector of a `center` (3,) m and a unit `axis` (3,) in the optical frame.

    The axis points to the side of `hint` (3,), world; z is as near as can be to the camera's up direction, or to its
    forward direction where the axis is nearly parallel to up. In plain arithmetic: scipy's transforms would take a
    third of the technique's time.
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
    return RigidTransform(out, normalize=False)  # it is a rotation: to normalise it would take as long again
