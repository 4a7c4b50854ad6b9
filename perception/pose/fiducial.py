"""The connector's pose from an ArUco tag on it (Hwang 2024, section 3.2.1), and the stow clip's from its own.

A square seen small has two poses that explain its corners nearly as well. Both are kept: the corners' misfit, and the
slant of the depth readings where there are any, say how likely each is, and what doubt is left widens the covariance.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cell import TAG_DICTIONARY, Clip, Connector, KnownCell, Tag, WristMount
from regrasp.interfaces.frame import Intrinsics, RgbdFrame
from regrasp.perception.camera.model import project, rays
from regrasp.perception.camera.registration import CARRIED, FIXED, CameraErrors
from regrasp.perception.pose.estimate import Estimate, NoEstimate
from regrasp.perception.pose.segmentation import NotSeen

FloatArray = NDArray[np.float64]

CORNER_NOISE = 0.15  # pixels: a corner's deviation, measured on renders by both renderers, sharp and blurred
SPARE = 2.0  # coordinates of four corners beyond what a pose takes; more misfit than that means more noise
CROP = 0.4  # of the tag's extent, beside it: room for the white border
MOST_SHIFT = 2.0  # pixels; plain corners are up to 1.0 off: beyond, a line was drawn to the plate's bright rim
ENLARGED = 2  # times; so the line fit takes slanting tags too: 200 of 200, where it took 196
DEPTH_NOISE = 0.0055  # 1/m: a reading's deviation over its square; subpixel 0.2, focal length 666 px, baseline 0.055 m
PATCH = 50.0  # pixels an independent reading; choice: a stereo matching window of some 8 pixels
MIN_READINGS = 20
SIZE_ERROR = 0.05  # choice: two deviations of the depth's scale, 3 %, and as much again for the size
TURN = 1.0  # rad; choice: what is known of the tilt beforehand, which a frontal view hardly shows
EXACT = CameraErrors(0.0, 0.0, 0.0)  # without known boxes poses stand in the camera's own frame, as in `register`
CROSSES = np.cross(np.eye(3)[:, None], np.eye(3))  # (3, 3, 3): the products of the unit vectors


@dataclass(frozen=True, eq=False)
class TagPose:
    """Where a tagged body is.

    `covariance` (6, 6): of the body's origin (m^2), then of a small turn (rad^2), about the axes of the frame in which
    the pose is; `readings`: depth readings used; `area`: pixels of the tag; `doubt`: probability of the other pose.
    """

    pose: RigidTransform
    covariance: FloatArray
    readings: int
    area: int
    doubt: float


class Fiducial:
    """A `regrasp.perception.pose.technique.Technique`. It knows the tags, and where on their bodies they are.

    Raises ValueError for a cell whose connector has no tag.
    """

    def __init__(self, known: KnownCell) -> None:
        if known.connector.tag is None:
            raise ValueError("the cell's connector has no tag; give known.connector.tag, as the cell thesis_tags does")
        self._connector, self._clip = known.connector, known.clip
        self._carried = {c.name for c in known.cameras if isinstance(c.mount, WristMount)}
        self._in_cell = bool(known.boxes)

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
        )

    def seat(self, frame: RgbdFrame, world_from_camera: RigidTransform) -> TagPose | NoEstimate:
        """Pose of the stow clip's seat in the world, by the clip's tag."""
        return self._find(frame, world_from_camera, self._clip, None)

    def _find(
        self, frame: RgbdFrame, world_from_camera: RigidTransform, body: Connector | Clip, near: FloatArray | None
    ) -> TagPose | NoEstimate:
        if body.tag is None:
            return NoEstimate(frame.stamp, frame.camera, NotSeen.NO_TAG, "the cell gives this body no tag")
        seen_near = None if near is None else world_from_camera.inv().apply(near)
        found = find_tag(frame, body.tag, seen_near)
        if isinstance(found, NoEstimate):
            return found
        errors = (CARRIED if frame.camera in self._carried else FIXED) if self._in_cell else EXACT
        return _in_world(found, world_from_camera, errors)


def find_tag(frame: RgbdFrame, tag: Tag, near: FloatArray | None = None) -> TagPose | NoEstimate:
    """Pose of the body that carries `tag`, in the optical frame.

    Of several such tags that nearest in the image to the point `near` (3,) m, without it the largest.
    """
    corners = _corners(frame, tag.number, near)
    solved = None if corners is None else _solve(corners, tag, frame.intrinsics)
    if corners is None or solved is None:
        return NoEstimate(frame.stamp, frame.camera, NotSeen.NO_TAG, f"no tag {tag.number} in the picture")
    poses, squares, misfits = solved
    at, readings = _readings(frame, corners)
    by_size = float(squares[0, :, 2].mean())
    if len(readings) and abs(float(np.median(readings)) / by_size - 1.0) > SIZE_ERROR:
        message = f"tag {tag.number} is {by_size:.2f} m away by its size, {np.median(readings):.2f} m by depth"
        return NoEstimate(frame.stamp, frame.camera, NotSeen.WRONG_SIZE, message)
    excess = max(1.0, float(misfits.min()) / SPARE)
    misfits = misfits / excess + [_slant_misfit(square, at, readings) for square in squares]
    shares = np.exp(-0.5 * (misfits - misfits.min()))
    shares /= shares.sum()
    best = int(np.argmax(shares))
    bodies = poses * _tag_from_body(tag)
    body = bodies[best]
    covariance = excess * _covariance(squares[best], body.translation, frame.intrinsics)
    apart = np.hstack([bodies.translation - body.translation, (bodies * body.inv()).rotation.as_rotvec()])
    covariance += (apart * shares[:, None]).T @ apart
    area = round(float(cv2.contourArea(corners.astype(np.float32))))
    return TagPose(body, covariance, len(readings), area, 1.0 - float(shares[best]))


@lru_cache(maxsize=4)  # a pure function of a value
def _tag_from_body(tag: Tag) -> RigidTransform:
    return tag.body_from_tag.inv()


@lru_cache(maxsize=2)
def _detector(refinement: int) -> Any:
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = refinement
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, TAG_DICTIONARY))
    return cv2.aruco.ArucoDetector(dictionary, parameters)


def _corners(frame: RgbdFrame, number: int, near: FloatArray | None) -> FloatArray | None:
    """Corners (4, 2) of the tag in pixels, from its top left clockwise; None if it is not seen.

    Its edges are fitted in an enlarged picture of the tag alone: 2 ms, and 0.13 pixels off where plain corners are 0.6.
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
    margin = CROP * np.ptp(plain, axis=0)
    u, v = np.maximum(plain.min(axis=0) - margin, 0).astype(int)
    right, bottom = (plain.max(axis=0) + margin).astype(int)
    crop = cv2.resize(gray[v : bottom + 1, u : right + 1], None, fx=ENLARGED, fy=ENLARGED)
    refined = _detect(crop, number, cv2.aruco.CORNER_REFINE_APRILTAG)
    if len(refined) != 1:
        return None
    corners = refined[0] / ENLARGED - 0.5 + [u, v]  # these count from the corner of a pixel, all others from its centre
    return corners if float(np.abs(corners - plain).max()) < MOST_SHIFT else None


def _detect(gray: NDArray[np.uint8], number: int, refinement: int) -> list[FloatArray]:
    found, numbers, _ = _detector(refinement).detectMarkers(gray)
    seen = [] if numbers is None else numbers.ravel().tolist()
    return [corners[0].astype(np.float64) for corners, n in zip(found, seen, strict=False) if n == number]


def _solve(corners: FloatArray, tag: Tag, k: Intrinsics) -> tuple[RigidTransform, FloatArray, FloatArray] | None:
    """The n poses camera_from_tag of the square (IPPE), refined; its corners (n, 4, 3) m there, in the optical frame;
    and the misfit of each (n,), squared and in deviations. n is 2, for an exact square 1; None if there is no pose.
    """
    square = 0.5 * tag.size * np.array([[-1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, -1.0, 0.0]])
    matrix = np.array([[k.fx, 0.0, k.cx], [0.0, k.fy, k.cy], [0.0, 0.0, 1.0]])
    _, *first, _ = cv2.solvePnPGeneric(square, corners, matrix, None, flags=cv2.SOLVEPNP_IPPE_SQUARE)
    refined = [cv2.solvePnPRefineLM(square, corners, matrix, None, *start) for start in zip(*first, strict=True)]
    finite = [pose for pose in refined if np.isfinite(pose).all()]  # of an exact square the second is not
    if not finite:
        return None
    turns, places = (np.array(part)[:, :, 0] for part in zip(*finite, strict=True))
    rotations = Rotation.from_rotvec(turns)
    squares = square @ rotations.as_matrix().transpose(0, 2, 1) + places[:, None]
    misses = np.nan_to_num(project(squares.reshape(-1, 3), k).reshape(-1, 4, 2) - corners, nan=np.inf)
    return RigidTransform.from_components(places, rotations), squares, (misses**2).sum(axis=(1, 2)) / CORNER_NOISE**2


def _readings(frame: RgbdFrame, corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rays (n, 3) at depth 1 and depth readings (n,) m on the tag; none if there are too few."""
    whole = np.rint(corners).astype(np.int32)
    left, top, width, height = cv2.boundingRect(whole)
    window = np.s_[max(top, 0) : top + height, max(left, 0) : left + width]
    depth, at = frame.depth[window], rays(frame.intrinsics)[window]
    mask = np.zeros(depth.shape, np.uint8)
    cv2.fillConvexPoly(mask, whole - np.maximum([left, top], 0), 1)
    read = (mask > 0) & np.isfinite(depth) & (depth > 0)
    if np.count_nonzero(read) < MIN_READINGS:
        return np.empty((0, 3)), np.empty(0)
    return at[read].astype(np.float64), depth[read].astype(np.float64)


def _slant_misfit(square: FloatArray, at: FloatArray, readings: FloatArray) -> float:
    """How badly the plane of `square` (4, 3) m fits the readings, squared and in deviations; an offset is no misfit."""
    if not len(readings):
        return 0.0
    normal = np.cross(square[1] - square[0], square[3] - square[0])
    normal /= np.linalg.norm(normal)
    facing = at @ normal
    miss = readings - float(square[0] @ normal) / np.where(np.abs(facing) < 1e-3, 1e-3, facing)
    miss = (miss - np.median(miss)) / (DEPTH_NOISE * readings**2)
    return float(np.minimum(miss**2, 9.0).sum()) / PATCH


def _covariance(square: FloatArray, center: FloatArray, k: Intrinsics) -> FloatArray:
    """Covariance (6, 6) of a body's `center` (3,) m and turn, optical frame, by what moves the tag's corners (4, 3)."""
    x, y, z = square.T
    zero = np.zeros(4)
    u = np.stack([k.fx / z, zero, -k.fx * x / z**2], axis=-1)
    v = np.stack([zero, k.fy / z, -k.fy * y / z**2], axis=-1)
    moved = np.concatenate([np.broadcast_to(np.eye(3), (4, 3, 3)), -_cross_matrices(square - center)], axis=2)
    jacobian = (np.stack([u, v], axis=1) @ moved).reshape(8, 6) / CORNER_NOISE
    known = np.diag([0.0, 0.0, 0.0, *[TURN**-2] * 3])
    return np.asarray(np.linalg.inv(jacobian.T @ jacobian + known))


def _cross_matrices(vectors: FloatArray) -> FloatArray:
    """Matrices (..., 3, 3) that times w give v x w for each v of `vectors` (..., 3)."""
    return np.asarray(np.tensordot(vectors, CROSSES, 1).swapaxes(-1, -2))


def _in_world(found: TagPose, world_from_camera: RigidTransform, errors: CameraErrors) -> TagPose:
    """The same in the world, by a camera whose pose has these errors."""
    pose = world_from_camera * found.pose
    turn = np.kron(np.eye(2), world_from_camera.as_matrix()[:3, :3])
    sway = np.eye(6)
    sway[:3, 3:] = -_cross_matrices(pose.translation - world_from_camera.translation)
    camera = sway @ np.diag([errors.position**2] * 3 + [errors.turn**2] * 3) @ sway.T
    return TagPose(pose, turn @ found.covariance @ turn.T + camera, found.readings, found.area, found.doubt)
