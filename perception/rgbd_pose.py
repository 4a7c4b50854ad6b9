"""The connector's pose from its colour and depth (Hwang 2024, section 3.2.3), and what its size adds."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from interfaces.cell import Connector, KnownCell
from interfaces.frame import RgbdFrame
from perception.camera_model import deproject, project
from perception.estimate import Estimate, NoEstimate, pose_covariance
from perception.segmentation import NoSegment, NotSeen, SegmentationParameters, segment

FloatArray = NDArray[np.float64]

MIN_POINTS = 20  # choice: n-mean and min/max need distinct points
MIDDLE_SHARE = 0.2  # choice: n for the position is a fifth of the points: averages noise and stays in the middle
FIT_STEPS, FIT_POINTS = 4, 400  # choice: eight steps changed the errors by less than a tenth; 400 points are quick
FIT_FADE = 0.004  # m; choice: the depth noise at 0.75 m is 3 mm
FIT_COSINE = 0.9  # choice: a fit that turns the principal axis by more than 25 degrees went astray
WHOLE_SHARE = 0.9  # choice: a visible part of nine tenths of the length has its centre within 5 mm
NEARER = 0.02  # m; choice: the connector's thickness, six deviations of the depth noise at 0.75 m
BEYOND = 0.02  # m; choice: reaches across the depth shadow (8 px = 9 mm beside an edge 0.1 m in front)
END_SHARE = 0.05  # choice: n for each end is a twentieth: 70 points at 0.75 m; more would shorten the vector
# Of position and axis, root mean square over the thesis's nine configurations: its chain cannot tell a hidden part.
POSITION_DEVIATION, ANGLE_DEVIATION = 0.012, 0.3  # m each axis, rad
DEVIATIONS = 2.0  # choice: an even spread ends at 1.73 standard deviations, so 2 cuts outliers and no ends
LEFT = np.array([0.0, 1.0, 0.0])  # the sign of the axis without a hint: plugs of the cell point to +y


class Rgbd:
    """The thesis's chain as a `perception.technique.Technique`: it knows the connector's colour."""

    def __init__(self, known: KnownCell) -> None:
        self._connector = known.connector

    def estimate(
        self,
        frame: RgbdFrame,
        world_from_camera: RigidTransform,
        *,
        axis: FloatArray | None = None,
        near: FloatArray | None = None,
    ) -> Estimate | NoEstimate:
        """See `Technique.estimate`."""
        return estimate(frame, world_from_camera, self._connector, hint=axis, faithful=True)


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
    if faithful:
        center, axis, whole = n_mean(points), min_max_axis(points), False
        extent = float(np.subtract(*np.percentile(points @ axis, [99, 1])))
    else:
        center, axis = refine_axis_and_center(points, connector.radius)
        low, high = _ends(points, center, axis)
        extent = float(np.linalg.norm(high - low))
        center, whole = _whole_center(frame, low, high, connector)
    position, axis = world_from_camera.apply(center), world_from_camera.rotation.apply(axis)
    axis *= 1.0 if axis @ (LEFT if hint is None else hint) >= 0 else -1.0
    pose = RigidTransform.from_components(position, _rotation(axis, world_from_camera.rotation))
    covariance = pose_covariance(axis, POSITION_DEVIATION, ANGLE_DEVIATION)
    return Estimate(frame.stamp, frame.camera, position, axis, pose, covariance, len(points), found.area, extent, whole)


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
    spreads, vectors = [], []
    for k in (0, 1):
        order = np.argsort(points[:, k], kind="stable")
        vectors.append(points[order[-n:]].mean(axis=0) - points[order[:n]].mean(axis=0))
        spreads.append(vectors[k][k])
    vector = vectors[int(np.argmax(spreads))]
    return np.asarray(vector / np.linalg.norm(vector))


def pca_axis(points: FloatArray) -> FloatArray:
    """Unit vector (3,) along which `points` (m, 3) spread most."""
    centred = points - points.mean(axis=0)
    return np.asarray(np.linalg.eigh(centred.T @ centred)[1][:, -1])


def refine_axis_and_center(points: FloatArray, radius: float) -> tuple[FloatArray, FloatArray]:
    """A point on the axis (3,) and the unit axis (3,) of a cylinder of `radius` m, one side seen as `points` (m, 3).

    Start: the principal axis, and the mean point pushed away from the camera. Across its width the visible side stands
    sqrt(r^2 - x^2) before the axis, on average (1/2r) int_-r^r sqrt(r^2 - x^2) dx = pi r / 4, and its normals are
    square to the axis, so the push is that long and along the part of the viewing ray that is square to the axis. Then
    Gauss-Newton steps on the distance from the axis less the radius. Optical frame.

    Measured at 0.75 m, mean axis error (free, 30 %, 50 % hidden): min/max 7.5, 11, 17 degrees; principal axis 1.9, 4.1,
    7.7; after the fit 1.0, 2.3, 3.7 (150 to 200 draws each, subpixel noise 0.2).
    """
    axis, mean = pca_axis(points), points.mean(axis=0)
    away = mean - (mean @ axis) * axis
    center = mean + np.pi / 4 * radius * away / np.linalg.norm(away)
    fitted, tilted = center, axis
    for _ in range(FIT_STEPS):
        fitted, tilted = _fit_step(points[:: 1 + len(points) // FIT_POINTS], fitted, tilted, radius)
    sane = tilted @ axis > FIT_COSINE and np.linalg.norm(fitted - center) < radius
    return (fitted, tilted) if sane else (center, axis)


def _fit_step(points: FloatArray, center: FloatArray, axis: FloatArray, radius: float) -> tuple[FloatArray, FloatArray]:
    """One Gauss-Newton step: moves the centre and tilts the axis along the two directions square to the axis.

    Depth noise lies along the viewing ray: it counts in full where the surface faces the camera and hardly at its rims,
    so a residual weighs 1 / (cos^2 + 0.05); those beyond some millimetres (end face, flying readings) fade (Cauchy).
    """
    across = np.cross(axis, center)
    across /= np.linalg.norm(across)  # square to the viewing ray
    frame = np.column_stack([across, np.cross(axis, across)])
    offset = points - center
    along, planar = offset @ axis, offset @ frame
    distance = np.maximum(np.linalg.norm(planar, axis=1), 1e-9)
    normal = planar / distance[:, None]
    residual = distance - radius
    weight = 1.0 / ((1.0 + (residual / FIT_FADE) ** 2) * (normal[:, 1] ** 2 + 0.05))
    jacobian = np.column_stack([normal, along[:, None] * normal])
    hessian = jacobian.T @ (jacobian * weight[:, None])
    hessian[np.diag_indices(4)] *= 1.0 + 1e-6  # a stub of the cylinder may not tell its tilt
    step = np.linalg.solve(hessian, jacobian.T @ (weight * residual))
    tilted = axis + frame @ step[2:]
    return center + frame @ step[:2], tilted / np.linalg.norm(tilted)


def _ends(points: FloatArray, center: FloatArray, axis: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The two ends (3,) of the visible part on the axis; the last hundredth of the points may be flying readings."""
    low, high = np.percentile((points - center) @ axis, [1, 99])
    return center + low * axis, center + high * axis


def _whole_center(frame: RgbdFrame, low: FloatArray, high: FloatArray, connector: Connector) -> tuple[FloatArray, bool]:
    """Centre (3,) of the connector from the ends of its visible part, and whether it is that of the whole connector.

    A part as long as the connector is the connector. If something hides just one end, the other and the length give it;
    of a stub less than twice as long as thick the axis is too uncertain to be sure of the far end.
    """
    extent = float(np.linalg.norm(high - low))
    axis = (high - low) / extent
    hidden_low, hidden_high = _is_hidden(frame, low, -axis), _is_hidden(frame, high, axis)
    if hidden_low == hidden_high or extent > connector.length:
        return (low + high) / 2, extent > WHOLE_SHARE * connector.length
    reach = 0.5 * connector.length * axis
    return (high - reach if hidden_low else low + reach), extent > 4 * connector.radius


def _is_hidden(frame: RgbdFrame, end: FloatArray, outward: FloatArray) -> bool:
    """Whether what is seen beyond an `end` (3,), going `outward` in the image, stands before it or the image stops."""
    here, there = project(np.array([end, end + 0.01 * outward]), frame.intrinsics)
    step = (there - here) / max(float(np.linalg.norm(there - here)), 1e-9)
    pixels = here + np.linspace(0.0, BEYOND * frame.intrinsics.fx / end[2], 20)[:, None] * step
    u, v = np.rint(pixels).astype(int).T
    if min(u.min(), v.min()) < 0 or u.max() >= frame.intrinsics.width or v.max() >= frame.intrinsics.height:
        return True
    depth = frame.depth[v, u]
    return int(np.count_nonzero((depth > 0) & (depth < end[2] - NEARER))) >= 3


def _rotation(axis: FloatArray, world_from_camera: Rotation) -> Rotation:
    """The rotation whose x is `axis` and whose z is as near as can be to the camera's up (forward if up aligns)."""
    up, forward = world_from_camera.apply([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0]])
    y = np.cross(up if abs(axis @ up) < 0.95 else forward, axis)
    y /= np.linalg.norm(y)
    return Rotation.from_matrix(np.column_stack([axis, y, np.cross(axis, y)]))
