"""The connector's pose from its colour and depth (Hwang 2024, sections 3.2.3.1 and 3.2.3.2), and what size adds to it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from interfaces.cell import Connector
from interfaces.frame import RgbdFrame
from perception.camera_model import deproject
from perception.segmentation import NoSegment, NotSeen, SegmentationParameters, segment

FloatArray = NDArray[np.float64]

MIN_POINTS = 20  # choice: n-mean and min/max need distinct points
MIDDLE_SHARE = 0.2  # choice: n for the position is a fifth of the points: averages noise and stays in the middle
END_SHARE = 0.05  # choice: n for each end is a twentieth: 70 points at 0.75 m; more would shorten the vector
DEVIATIONS = 2.0  # choice: an even spread ends at 1.73 standard deviations, so 2 cuts outliers and no ends
LEFT = np.array([0.0, 1.0, 0.0])  # the sign of the axis without a hint: plugs of the cell point to +y


@dataclass(frozen=True, eq=False)
class Estimate:
    """Where the connector is, by one frame. World frame, metres.

    `position` (3,): its centre, as far as it is visible; `axis` (3,): unit vector from cable to tip, sign by the hint;
    `extent`: length of the visible part along the axis; `points`: depth readings used; `mask_area`: pixels of its colour.
    """

    stamp: float
    camera: str
    position: FloatArray
    axis: FloatArray
    world_from_connector: RigidTransform
    points: int
    mask_area: int
    extent: float


@dataclass(frozen=True)
class NoEstimate:
    """No pose from this frame: the named reason, and a sentence with the numbers."""

    stamp: float
    camera: str
    reason: NotSeen
    message: str


def estimate(
    frame: RgbdFrame,
    world_from_camera: RigidTransform,
    connector: Connector,
    *,
    hint: FloatArray | None = None,
    faithful: bool = False,
) -> Estimate | NoEstimate:
    """The pose of the connector in `frame`.

    `faithful` uses its colour alone, as the thesis; else its radius and length centre the estimate in the body and
    straighten its axis. No view tells the two ends apart: the axis is given the sign that agrees with `hint` (3,), the
    direction from cable to tip as the caller last knew it, or world +y. The roll is the camera's, as in the thesis.
    """
    found = segment(frame.rgb, SegmentationParameters.for_color(connector.color))
    if isinstance(found, NoSegment):
        return NoEstimate(frame.stamp, frame.camera, found.reason, found.message)
    cloud = deproject(frame.depth, found.mask, frame.intrinsics)
    points = without_outliers(cloud) if len(cloud) >= MIN_POINTS else cloud
    if len(points) < MIN_POINTS:
        message = f"{len(points)} depth readings on {found.area} pixels of the connector, {MIN_POINTS} are needed"
        return NoEstimate(frame.stamp, frame.camera, NotSeen.NO_DEPTH, message)
    center, axis = n_mean(points), min_max_axis(points)
    if not faithful:
        center, axis = refine_axis_and_center(points, connector.radius, connector.length)
    axis = world_from_camera.rotation.apply(axis)
    axis *= 1.0 if axis @ (LEFT if hint is None else hint) >= 0 else -1.0
    position = world_from_camera.apply(center)
    pose = RigidTransform.from_components(position, _rotation(axis, world_from_camera.rotation))
    along = world_from_camera.apply(points) @ axis
    extent = float(np.subtract(*np.percentile(along, [99, 1])))
    return Estimate(frame.stamp, frame.camera, position, axis, pose, len(points), found.area, extent)


def without_outliers(points: FloatArray) -> FloatArray:
    """Those of `points` (n, 3) that lie within `DEVIATIONS` standard deviations of the mean along every axis."""
    deviation = np.abs(points - points.mean(axis=0))
    return np.asarray(points[np.all(deviation <= DEVIATIONS * points.std(axis=0) + 1e-9, axis=1)])


def n_mean(points: FloatArray) -> FloatArray:
    """Per axis, the mean of the n middle values of `points` (m, 3); (3,). n is `MIDDLE_SHARE` of m."""
    n = max(1, round(MIDDLE_SHARE * len(points)))
    start = (len(points) - n) // 2
    return np.asarray(np.sort(points, axis=0)[start : start + n].mean(axis=0))


def min_max_axis(points: FloatArray) -> FloatArray:
    """Unit vector (3,) from the mean of the n lowest to that of the n highest of `points` (m, 3), optical frame.

    Lowest and highest along image x or y, whichever lie further apart; n is `END_SHARE` of m.
    """
    n = max(1, round(END_SHARE * len(points)))
    vectors = []
    for k in (0, 1):
        order = np.argsort(points[:, k], kind="stable")
        vectors.append(points[order[-n:]].mean(axis=0) - points[order[:n]].mean(axis=0))
    vector = max(vectors, key=lambda v: float(np.linalg.norm(v)))
    return np.asarray(vector / np.linalg.norm(vector))


def pca_axis(points: FloatArray) -> FloatArray:
    """Unit vector (3,) along which `points` (m, 3) spread most."""
    centred = points - points.mean(axis=0)
    return np.asarray(np.linalg.eigh(centred.T @ centred)[1][:, -1])


def refine_axis_and_center(points: FloatArray, radius: float, length: float) -> tuple[FloatArray, FloatArray]:
    """Centre (3,) and unit axis (3,) of a cylinder seen from one side as `points` (m, 3), optical frame.

    Across its width the visible side stands sqrt(r^2 - x^2) before the cylinder's axis, on average
    (1/2r) int_-r^r sqrt(r^2 - x^2) dx = pi r / 4. The side's normals are square to the axis, so the mean point moves by
    that much along the part of the viewing ray that is square to the axis.
    """
    axis = pca_axis(points)
    mean = points.mean(axis=0)
    away = mean - (mean @ axis) * axis
    return mean + np.pi / 4 * radius * away / np.linalg.norm(away), axis


def _rotation(axis: FloatArray, world_from_camera: Rotation) -> Rotation:
    """The rotation whose x is `axis` and whose z is as near as can be to the camera's up, or its forward if they align."""
    up, forward = world_from_camera.apply([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0]])
    y = np.cross(up if abs(axis @ up) < 0.95 else forward, axis)
    y /= np.linalg.norm(y)
    return Rotation.from_matrix(np.column_stack([axis, y, np.cross(axis, y)]))
