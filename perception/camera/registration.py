"""Registers a camera's depth image to boxes of known place: corrects the camera's pose and its depth scale.

Three faces that are square to each other determine six of the seven unknowns. To scale all depths looks like moving
the camera away from all three faces, so the prior on the errors determines the seventh.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import Box, KnownCell, WristMount
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.geometry import rotation_about, skew
from regrasp.perception.camera.model import pixel_rays, subsampled


@dataclass(frozen=True)
class CameraErrors:
    """Standard deviations of a camera's assumed pose and depth: position (m, each axis), rotation (rad), scale."""

    position: float
    rotation: float
    scale: float


# Choice: the thesis cell's figures; a fixed camera is 2 mm and 0.3 degrees off, its depth scale 1.5 %.
FIXED_CAMERA_ERRORS = CameraErrors(0.002, 0.003, 0.015)
# Choice: an arm adds 5 mm at its tool, by joints that are some 8 mrad off, one of them 50 mrad now and then.
WRIST_CAMERA_ERRORS = CameraErrors(0.006, 0.02, 0.015)


@dataclass(frozen=True)
class RegistrationParameters:
    """Which depth readings count, and how much."""

    pixel_step: int = 16  # px between the readings used: 1,590 of them at 848x480
    gates: tuple[float, ...] = (0.06, 0.03, 0.015, 0.010)  # m; one iteration each, farther readings show other things
    face_border: float = 0.03  # m; the rim of a face does not count
    min_gated_share: float = 0.25  # choice: of a face direction's readings; with fewer, things stand before the faces
    neighbour_step: int = 2  # readings to the neighbours that must lie alike: 34 mm at 0.7 m
    max_unevenness: float = 0.017  # m between neighbours; choice: three standard deviations of their difference
    behind_distance: float = 0.03  # m behind a face, from which the camera seems to look through it
    max_behind_share: float = 0.2  # of the readings on faces; noise makes no such share
    min_readings: int = 30  # fewer correct nothing
    depth_noise: float = 0.0035  # m at the panels, 0.86 m away; an eighth under the true 0.004: robust weights widen it
    fixed_errors: CameraErrors = FIXED_CAMERA_ERRORS  # to expect of a camera that is fixed in the cell
    wrist_errors: CameraErrors = WRIST_CAMERA_ERRORS  # to expect of a camera that an arm carries


def expected_errors(
    known: KnownCell, camera: str, parameters: RegistrationParameters = RegistrationParameters()
) -> CameraErrors:
    """The errors to expect of a camera of the cell by its mount; a camera that is not in the cell counts as fixed."""
    mounts = [c.mount for c in known.cameras if c.name == camera]
    carried = any(isinstance(mount, WristMount) for mount in mounts)
    return parameters.wrist_errors if carried else parameters.fixed_errors


@dataclass(frozen=True, eq=False)
class Registration:
    r"""A camera's corrected pose `world_from_camera` and depth factor `scale`.

    `covariance` (7, 7) is of position (m), rotation (rad, world axes) and scale. `mahalanobis_sq` is the squared
    Mahalanobis distance of the correction :math:`x` (7,) by the expected errors :math:`\Sigma`, with 7 degrees of
    freedom; infinite where the camera looks through the faces:

    .. math:: d^2 = x^T \Sigma^{-1} x
    """

    world_from_camera: RigidTransform
    scale: float
    covariance: FloatArray
    mahalanobis_sq: float

    def point_covariance(self, point: FloatArray) -> FloatArray:
        """The share (6, 6) of the camera's errors in the covariance of a pose at `point` (3,) m: m^2, then rad^2.

        By the point's derivative: d point = d position + rotation x ray + scale * ray, in the world frame.
        """
        ray = point - self.world_from_camera.translation
        jacobian = np.zeros((6, 7))
        jacobian[:3, :3] = np.eye(3)
        jacobian[:3, 3:6] = -skew(ray)
        jacobian[:3, 6] = ray
        jacobian[3:, 3:6] = np.eye(3)
        return np.asarray(jacobian @ self.covariance @ jacobian.T)


def register(
    frame: RgbdFrame,
    world_from_camera: RigidTransform,
    boxes: Sequence[Box],
    errors: CameraErrors,
    parameters: RegistrationParameters = RegistrationParameters(),
) -> Registration:
    r"""Fit the camera's pose and depth scale to the faces of `boxes` that it sees, near to `world_from_camera`.

    Gauss-Newton on the distances :math:`r_i` of the readings from the faces that their rays meet, with the expected
    errors as a prior and the gate :math:`g` of each iteration as a scale for outliers:

    .. math:: \min_x \sum_i w_i r_i(x)^2 + x^T \Sigma^{-1} x, \quad
        w_i = \frac{1}{\sigma^2 (1 + (2 r_i / g)^2)}

    Without boxes the pose counts as exact: estimates then stand in the camera's own frame, and the scale stays as
    uncertain as `errors` says.
    """
    if not boxes:
        return Registration(world_from_camera, 1.0, np.diag([0.0] * 6 + [errors.scale**2]), 0.0)
    readings = _readings(frame, parameters.pixel_step)
    lower = np.array([np.asarray(box.center) - np.asarray(box.size) / 2 for box in boxes])
    upper = np.array([np.asarray(box.center) + np.asarray(box.size) / 2 for box in boxes])
    prior = np.diag(1.0 / np.repeat([errors.position, errors.rotation, errors.scale], [3, 3, 1]) ** 2)
    start = world_from_camera.as_matrix()
    rotation, position, scale = start[:3, :3], start[:3, 3], 1.0
    information, correction, behind_share = prior, np.zeros(7), 0.0
    limits = (
        parameters.face_border,
        parameters.min_gated_share,
        parameters.neighbour_step,
        parameters.max_unevenness,
        parameters.behind_distance,
        parameters.depth_noise,
    )
    for gate in parameters.gates:
        rays = scale * readings @ rotation.T
        measured, gradient, count, behind_share = _normal_equations(rays, position, lower, upper, gate, *limits)
        if count < parameters.min_readings:
            break
        information = prior + measured
        step = -np.linalg.solve(information, gradient + prior @ correction)
        correction = correction + step
        rotation, position = _rotation_matrix(step[3:6]) @ rotation, position + step[:3]
        scale = scale * (1.0 + float(step[6]))
    pose = RigidTransform(np.vstack([np.column_stack([rotation, position]), [0, 0, 0, 1]]), normalize=False)
    covariance = np.asarray(np.linalg.inv(information), float)
    looks_through = behind_share > parameters.max_behind_share
    return Registration(pose, scale, covariance, np.inf if looks_through else float(correction @ prior @ correction))


def _readings(frame: RgbdFrame, step: int) -> FloatArray:
    """Every `step`-th reading as a point (h, w, 3) m in the optical frame, 0 where there is none."""
    depth = frame.depth[::step, ::step]
    valid = np.where(np.isfinite(depth) & (depth > 0), depth, 0.0)
    return (pixel_rays(subsampled(frame.intrinsics, step)) * valid[..., None]).astype(float)


@numba.njit(cache=True, error_model="numpy")
def _normal_equations(
    rays: FloatArray,
    origin: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    gate: float,
    face_border: float,
    min_gated_share: float,
    neighbour_step: int,
    max_unevenness: float,
    behind_distance: float,
    depth_noise: float,
) -> tuple[FloatArray, FloatArray, int, float]:
    """Information (7, 7) and gradient (7,) of position, rotation and scale, the number of readings that count, and the
    share of the readings on faces that lie behind their face.

    `rays` (h, w, 3) m lead from the camera at `origin` (3,) to the readings, world frame, 0 where there is none; the
    boxes reach from `lower` to `upper` (m, 3).
    """
    information, gradient, row, count = np.zeros((7, 7)), np.zeros(7), np.zeros(7), 0
    height, width = rays.shape[:2]
    # The face that the ray of each reading meets, at which share of the ray, and the reading's distance before it (m).
    faces, shares = np.full((height, width), -1), np.zeros((height, width))
    residuals = np.zeros((height, width))
    on_face, gated, behind = np.zeros(6), np.zeros(6), 0
    for v in range(height):
        for u in range(width):
            if rays[v, u, 0] == 0.0 and rays[v, u, 1] == 0.0 and rays[v, u, 2] == 0.0:
                continue
            axis, side, share = _first_face(rays[v, u], origin, lower, upper, face_border)
            if axis >= 0:
                residual = side * rays[v, u, axis] * (1.0 - share)
                faces[v, u], shares[v, u], residuals[v, u] = 2 * axis + (side > 0), share, residual
                on_face[faces[v, u]] += 1
                behind += residual < -behind_distance
    counts = np.zeros((height, width), np.bool_)
    for v in range(height):
        for u in range(width):
            near = faces[v, u] >= 0 and abs(residuals[v, u]) < gate
            if near and _even(faces, residuals, v, u, neighbour_step, max_unevenness):
                counts[v, u] = True
                gated[faces[v, u]] += 1
    for v in range(height):
        for u in range(width):
            face, share, residual = faces[v, u], shares[v, u], residuals[v, u]
            if not counts[v, u] or gated[face] < min_gated_share * on_face[face]:
                continue
            axis, side = face // 2, 1.0 if face % 2 else -1.0
            # Derivatives at the face, not at the reading: noise in both would look like a smaller scale.
            x, y, z = share * rays[v, u, 0], share * rays[v, u, 1], share * rays[v, u, 2]
            row[:] = 0.0
            row[axis] = side
            if axis == 0:
                row[4], row[5] = side * z, -side * y
            elif axis == 1:
                row[3], row[5] = -side * z, side * x
            else:
                row[3], row[4] = side * y, -side * x
            row[6] = side * share * rays[v, u, axis]
            weight = 1.0 / depth_noise**2 / (1.0 + (2.0 * residual / gate) ** 2)
            count += 1
            for j in range(7):
                gradient[j] += weight * residual * row[j]
                for k in range(7):
                    information[j, k] += weight * row[j] * row[k]
    return information, gradient, count, behind / max(1.0, on_face.sum())


@numba.njit(cache=True, error_model="numpy")
def _even(faces: NDArray[np.int64], residuals: FloatArray, v: int, u: int, step: int, max_unevenness: float) -> bool:
    """Whether the neighbours of a reading on its face have the same residual; not so at the foot of an obstacle."""
    for dv, du in ((-step, 0), (step, 0), (0, -step), (0, step)):
        other_v, other_u = v + dv, u + du
        beyond = not (0 <= other_v < faces.shape[0] and 0 <= other_u < faces.shape[1])
        if beyond or faces[other_v, other_u] != faces[v, u]:
            continue
        if abs(residuals[other_v, other_u] - residuals[v, u]) > max_unevenness:
            return False
    return True


@numba.njit(cache=True, error_model="numpy")
def _first_face(
    ray: FloatArray, origin: FloatArray, lower: FloatArray, upper: FloatArray, border: float
) -> tuple[int, float, float]:
    """Axis and side of the box face that `origin` + t * `ray` meets first, and its t; axis -1 within its `border`."""
    first, best, outward, at_border = np.inf, -1, 0.0, False
    for b in range(len(lower)):
        for axis in range(3):
            if lower[b, axis] <= origin[axis] <= upper[b, axis]:
                continue
            side = 1.0 if origin[axis] > upper[b, axis] else -1.0
            face = upper[b, axis] if side > 0 else lower[b, axis]
            t = (face - origin[axis]) / ray[axis]
            if not 0.0 < t < first:
                continue
            inside, in_border = True, False
            for other in range(3):
                if other != axis:
                    at = origin[other] + t * ray[other]
                    margin = min(at - lower[b, other], upper[b, other] - at)
                    inside = inside and margin > 0.0
                    in_border = in_border or margin < border
            if inside:
                first, best, outward, at_border = t, axis, side, in_border
    return (-1 if at_border else best), outward, first


def _rotation_matrix(vector: FloatArray) -> FloatArray:
    """The rotation matrix (3, 3) of a rotation vector (3,) rad."""
    angle = float(np.linalg.norm(vector))
    return np.eye(3) if angle < 1e-12 else rotation_about(vector / angle, angle)
