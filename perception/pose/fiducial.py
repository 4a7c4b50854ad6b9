"""The connector's pose from an ArUco tag on it (Hwang 2024, section 3.2.1), and the stow clip's from its own tag.

A square that is small in the image has two poses that explain its corners nearly as well (the ambiguity of planar
pose estimation). Both are kept. The corners' residuals, and the slant of the depth readings where there are any, say
how likely each pose is; the doubt that remains widens the covariance.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableKnown, Clip, Connector
from regrasp.interfaces.cell import WristMount
from regrasp.interfaces.frame import Intrinsics, RgbdFrame
from regrasp.interfaces.geometry import skew
from regrasp.interfaces.tag import TAG_DICTIONARY, Tag
from regrasp.perception.camera.model import pixel_rays, project
from regrasp.perception.camera.registration import FIXED_CAMERA_ERRORS, WRIST_CAMERA_ERRORS, CameraErrors
from regrasp.perception.pose.estimate import Estimate, NoEstimate
from regrasp.perception.pose.segmentation import NotSeen

NO_ERRORS = CameraErrors(0.0, 0.0, 0.0)  # without known boxes poses stand in the camera's own frame, as in `register`
REDUNDANCY = 2.0  # degrees of freedom: the 8 coordinates of four corners less the 6 of a pose


@dataclass(frozen=True)
class FiducialParameters:
    """How a tag's corners are refined, and what noise corners and depth have."""

    corner_noise: float = 0.15  # px, a corner's deviation; measured on renders by both renderers, sharp and blurred
    crop_margin: float = 0.4  # of the tag's extent, on each side of it: room for the white border
    enlargement: int = 2  # of the crop; with it the edge fit takes slanting tags too: 200 of 200, without it 196
    max_refinement: float = 2.0  # px; plain corners are up to 1.0 off, and a line fitted to the plate's rim more
    depth_noise: float = 0.0055  # 1/m: deviation over square of a reading; 0.2 px disparity, 666 px focal, 0.055 m base
    independent_area: float = 50.0  # pixels an independent reading; choice: a stereo matching window of some 8 pixels
    min_readings: int = 20  # on the tag; with fewer, depth is not used
    max_depth_residual: float = 3.0  # deviations; what is further off counts as this
    max_size_error: float = 0.05  # choice: two deviations of the depth's scale, 3 %, and as much again for the size
    tilt_deviation: float = 1.0  # rad; choice: prior on the rotation, which a frontal view hardly shows
    fixed_errors: CameraErrors = FIXED_CAMERA_ERRORS  # to expect of a camera that is fixed in the cell
    wrist_errors: CameraErrors = WRIST_CAMERA_ERRORS  # to expect of a camera that an arm carries


@dataclass(frozen=True, eq=False)
class TagPose:
    """Where a tagged body is.

    `covariance` (6, 6): of the body's origin (m^2), then of a small rotation (rad^2), about the axes of the frame in
    which the pose is; `readings`: depth readings used; `area`: pixels of the tag; `ambiguity`: probability of the
    other pose.
    """

    pose: RigidTransform
    covariance: FloatArray
    readings: int
    area: int
    ambiguity: float


class Fiducial:
    """A `regrasp.perception.pose.technique.Technique`. It knows the tags, and where on their bodies they are.

    Raises ValueError for a cell whose connector has no tag.
    """

    def __init__(self, known: CableKnown, parameters: FiducialParameters = FiducialParameters()) -> None:
        if known.cable.connector.tag is None:
            raise ValueError(
                "the cell's connector has no tag; give known.cable.connector.tag, as the cell thesis_tags does"
            )
        self._connector, self._clip = known.cable.connector, known.cable.clip
        self._carried = {c.name for c in known.cameras if isinstance(c.mount, WristMount)}
        self._in_cell = bool(known.boxes)
        self._parameters = parameters

    def estimate(
        self,
        frame: RgbdFrame,
        world_from_camera: RigidTransform,
        *,
        axis: FloatArray | None = None,
        near: FloatArray | None = None,
    ) -> Estimate | NoEstimate:
        """See `Technique.estimate`. The tag tells the ends apart, so `axis` is not needed; nor is depth."""
        found = self._find(frame, world_from_camera, self._connector, near)
        if isinstance(found, NoEstimate):
            return found
        position, along = found.pose.translation, found.pose.as_matrix()[:3, 0]
        return Estimate(
            frame.stamp,
            frame.camera,
            position,
            along,
            found.pose,
            found.covariance,
            found.readings,
            found.area,
            self._connector.length,
            whole=True,
            sign_seen=True,
            world_from_camera=world_from_camera,
        )

    def seat(self, frame: RgbdFrame, world_from_camera: RigidTransform) -> TagPose | NoEstimate:
        """Pose of the stow clip's seat in the world, by the clip's tag."""
        return self._find(frame, world_from_camera, self._clip, None)

    def _find(
        self, frame: RgbdFrame, world_from_camera: RigidTransform, body: Connector | Clip, near: FloatArray | None
    ) -> TagPose | NoEstimate:
        if body.tag is None:
            return NoEstimate(frame.stamp, frame.camera, NotSeen.NO_TAG, "the cell gives this body no tag")
        near_in_camera = None if near is None else world_from_camera.inv().apply(near)
        found = find_tag(frame, body.tag, near_in_camera, self._parameters)
        if isinstance(found, NoEstimate):
            return found
        carried = frame.camera in self._carried
        errors = self._parameters.wrist_errors if carried else self._parameters.fixed_errors
        return _in_world(found, world_from_camera, errors if self._in_cell else NO_ERRORS)


def find_tag(
    frame: RgbdFrame, tag: Tag, near: FloatArray | None = None, parameters: FiducialParameters = FiducialParameters()
) -> TagPose | NoEstimate:
    r"""Pose of the body that carries `tag`, in the optical frame.

    Of several such tags it takes the one nearest in the image to the point `near` (3,) m, optical frame; without it
    the largest. Each pose :math:`i` with the squared residuals :math:`d_i^2` has the probability

    .. math:: p_i = e^{-d_i^2 / 2} / \sum_j e^{-d_j^2 / 2}
    """
    corners = _corners(frame, tag.number, near, parameters)
    solved = None if corners is None else _solve(corners, tag, frame.intrinsics, parameters.corner_noise)
    if corners is None or solved is None:
        return NoEstimate(frame.stamp, frame.camera, NotSeen.NO_TAG, f"no tag {tag.number} in the picture")
    poses, squares, residuals_sq = solved
    rays, readings = _readings(frame, corners, parameters.min_readings)
    by_size = float(squares[0, :, 2].mean())
    if len(readings) and abs(float(np.median(readings)) / by_size - 1.0) > parameters.max_size_error:
        message = f"tag {tag.number} is {by_size:.2f} m away by its size, {np.median(readings):.2f} m by depth"
        return NoEstimate(frame.stamp, frame.camera, NotSeen.WRONG_SIZE, message)
    excess = max(1.0, float(residuals_sq.min()) / REDUNDANCY)  # larger residuals mean more noise than assumed
    residuals_sq = residuals_sq / excess + [_slant_residual_sq(s, rays, readings, parameters) for s in squares]
    shares = np.exp(-0.5 * (residuals_sq - residuals_sq.min()))
    shares /= shares.sum()
    best = int(np.argmax(shares))
    bodies = poses * _tag_from_body(tag)
    body = bodies[best]
    covariance = excess * _covariance(squares[best], body.translation, frame.intrinsics, parameters)
    apart = np.hstack([bodies.translation - body.translation, (bodies * body.inv()).rotation.as_rotvec()])
    covariance += (apart * shares[:, None]).T @ apart
    area = round(float(cv2.contourArea(corners.astype(np.float32))))
    return TagPose(body, covariance, len(readings), area, 1.0 - float(shares[best]))


@lru_cache(maxsize=4)  # a pure function of a value
def _tag_from_body(tag: Tag) -> RigidTransform:
    return tag.body_from_tag.inv()


@lru_cache(maxsize=2)
def _aruco_detector(refinement: int) -> Any:
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = refinement
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, TAG_DICTIONARY))
    return cv2.aruco.ArucoDetector(dictionary, parameters)


def _corners(
    frame: RgbdFrame, number: int, near: FloatArray | None, parameters: FiducialParameters
) -> FloatArray | None:
    """Corners (4, 2) of the tag in pixels, from its top left clockwise; None if it is not seen.

    Its edges are fitted in an enlarged crop of the tag. This takes 2 ms, and its corners are 0.13 pixels off, where
    plain corners are 0.6 pixels off.
    """
    gray = cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2GRAY)
    candidates = _detect(gray, number, cv2.aruco.CORNER_REFINE_NONE)
    if not candidates:
        return None
    if near is not None and near[2] > 0:
        at = project(near[None], frame.intrinsics)[0]
        plain = min(candidates, key=lambda c: float(np.linalg.norm(c.mean(axis=0) - at)))
    else:
        plain = max(candidates, key=lambda c: cv2.contourArea(c.astype(np.float32)))
    margin, zoom = parameters.crop_margin * np.ptp(plain, axis=0), parameters.enlargement
    u, v = np.maximum(plain.min(axis=0) - margin, 0).astype(int)
    right, bottom = (plain.max(axis=0) + margin).astype(int)
    crop = cv2.resize(gray[v : bottom + 1, u : right + 1], None, fx=zoom, fy=zoom)
    refined = _detect(crop, number, cv2.aruco.CORNER_REFINE_APRILTAG)
    if len(refined) != 1:
        return None
    corners = refined[0] / zoom - 0.5 + [u, v]  # these count from the corner of a pixel, all others from its centre
    return corners if float(np.abs(corners - plain).max()) < parameters.max_refinement else None


def _detect(gray: NDArray[np.uint8], number: int, refinement: int) -> list[FloatArray]:
    found, numbers, _ = _aruco_detector(refinement).detectMarkers(gray)
    seen = [] if numbers is None else numbers.ravel().tolist()
    return [corners[0].astype(np.float64) for corners, n in zip(found, seen, strict=False) if n == number]


def _solve(
    corners: FloatArray, tag: Tag, k: Intrinsics, corner_noise: float
) -> tuple[RigidTransform, FloatArray, FloatArray] | None:
    """The n poses camera_from_tag of the square (IPPE, Collins and Bartoli 2014), refined by Levenberg-Marquardt.

    With them the tag's corners (n, 4, 3) m in the optical frame, and each pose's sum of squared residuals (n,) in
    deviations of `corner_noise` (px). n is 2, for an exact square 1; None if there is no pose.
    """
    square = 0.5 * tag.size * np.array([[-1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, -1.0, 0.0]])
    matrix = np.array([[k.fx, 0.0, k.cx], [0.0, k.fy, k.cy], [0.0, 0.0, 1.0]])
    _, *first, _ = cv2.solvePnPGeneric(square, corners, matrix, None, flags=cv2.SOLVEPNP_IPPE_SQUARE)
    refined = [cv2.solvePnPRefineLM(square, corners, matrix, None, *start) for start in zip(*first, strict=True)]
    finite = [pose for pose in refined if np.isfinite(pose).all()]  # of an exact square the second is not
    if not finite:
        return None
    rotvecs, positions = (np.array(part)[:, :, 0] for part in zip(*finite, strict=True))
    rotations = Rotation.from_rotvec(rotvecs)
    squares = square @ rotations.as_matrix().transpose(0, 2, 1) + positions[:, None]
    residuals = np.nan_to_num(project(squares.reshape(-1, 3), k).reshape(-1, 4, 2) - corners, nan=np.inf)
    residuals_sq = (residuals**2).sum(axis=(1, 2)) / corner_noise**2
    return RigidTransform.from_components(positions, rotations), squares, residuals_sq


def _readings(frame: RgbdFrame, corners: FloatArray, min_readings: int) -> tuple[FloatArray, FloatArray]:
    """Rays (n, 3) at depth 1 and depth readings (n,) m on the tag; none if there are too few."""
    polygon = np.rint(corners).astype(np.int32)
    left, top, width, height = cv2.boundingRect(polygon)
    window = np.s_[max(top, 0) : top + height, max(left, 0) : left + width]
    depth, rays = frame.depth[window], pixel_rays(frame.intrinsics)[window]
    mask = np.zeros(depth.shape, np.uint8)
    cv2.fillConvexPoly(mask, polygon - np.maximum([left, top], 0), 1)
    read = (mask > 0) & np.isfinite(depth) & (depth > 0)
    if np.count_nonzero(read) < min_readings:
        return np.empty((0, 3)), np.empty(0)
    return rays[read].astype(np.float64), depth[read].astype(np.float64)


def _slant_residual_sq(
    square: FloatArray, rays: FloatArray, readings: FloatArray, parameters: FiducialParameters
) -> float:
    """Sum of squared residuals, in deviations, of the readings from the plane of `square` (4, 3) m.

    Less their median, so that the plane's offset does not count.
    """
    if not len(readings):
        return 0.0
    normal = np.cross(square[1] - square[0], square[3] - square[0])
    normal /= np.linalg.norm(normal)
    facing = rays @ normal
    residuals = readings - float(square[0] @ normal) / np.where(np.abs(facing) < 1e-3, 1e-3, facing)
    residuals = (residuals - np.median(residuals)) / (parameters.depth_noise * readings**2)
    capped = np.minimum(residuals**2, parameters.max_depth_residual**2)
    return float(capped.sum()) / parameters.independent_area


def _covariance(square: FloatArray, center: FloatArray, k: Intrinsics, parameters: FiducialParameters) -> FloatArray:
    r"""Covariance (6, 6) of the pose of a body at `center` (3,) m, optical frame, from the tag's corners (4, 3) m.

    With the Jacobian :math:`J` (8, 6) of the corners' pixels by position and rotation and the prior
    :math:`\Lambda` on the rotation:

    .. math:: \Sigma = (J^T J / \sigma^2 + \Lambda)^{-1}
    """
    x, y, z = square.T
    zero = np.zeros(4)
    u = np.stack([k.fx / z, zero, -k.fx * x / z**2], axis=-1)
    v = np.stack([zero, k.fy / z, -k.fy * y / z**2], axis=-1)
    moved = np.concatenate([np.broadcast_to(np.eye(3), (4, 3, 3)), -skew(square - center)], axis=2)
    jacobian = (np.stack([u, v], axis=1) @ moved).reshape(8, 6) / parameters.corner_noise
    prior = np.diag([0.0, 0.0, 0.0, *[parameters.tilt_deviation**-2] * 3])
    return np.asarray(np.linalg.inv(jacobian.T @ jacobian + prior))


def _in_world(found: TagPose, world_from_camera: RigidTransform, errors: CameraErrors) -> TagPose:
    """The same in the world, by a camera whose pose has these errors."""
    pose = world_from_camera * found.pose
    rotation = np.kron(np.eye(2), world_from_camera.as_matrix()[:3, :3])
    jacobian = np.eye(6)
    jacobian[:3, 3:] = -skew(pose.translation - world_from_camera.translation)
    camera = jacobian @ np.diag([errors.position**2] * 3 + [errors.rotation**2] * 3) @ jacobian.T
    covariance = rotation @ found.covariance @ rotation.T + camera
    return TagPose(pose, covariance, found.readings, found.area, found.ambiguity)
