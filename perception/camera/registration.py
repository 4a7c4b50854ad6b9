"""Where a camera really is, and how far its depth scale is off: its depth against boxes whose place is known.

Three faces that are square to each other give six of the seven unknowns; scaling all depths looks like moving the
camera away from all three, so the expected errors settle the seventh.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cell import Box, KnownCell, WristMount
from regrasp.interfaces.frame import RgbdFrame
from regrasp.perception.camera.model import rays, subsampled

FloatArray = NDArray[np.float64]

STEP = 16  # pixels
BORDER = 0.03  # m of a face's rim that do not count
GATES = (0.06, 0.03, 0.015, 0.010)  # m: readings further off show something else; each step trusts a better pose
MIN_SHARE = 0.25  # choice: of a way that faces look; where fewer come within the gate, other things stand before them
AROUND = 2  # readings away: 34 mm at 0.7 m
UNEVEN = 0.017  # m; choice: three deviations of a difference
BEHIND, MAX_THROUGH = 0.03, 0.2  # m behind a face, and the share of readings there: noise makes no such share
MIN_READINGS = 30  # of 1,590 at 848x480
NOISE = 0.0035  # m, of depth at the panels, 0.86 m away: 0.004, less an eighth for what the weights leave untold


@dataclass(frozen=True)
class CameraErrors:
    """Standard deviations of what a camera is told wrong: position (m, each axis), turn (rad, each axis), scale."""

    position: float
    turn: float
    scale: float


# choice: the thesis cell's figures; a fixed camera is 2 mm and 0.3 degrees off, its depth scale 1.5 %
FIXED = CameraErrors(0.002, 0.003, 0.015)
# choice: an arm adds 5 mm at its tool, made by joints some 8 mrad off, now and then one of them 50
CARRIED = CameraErrors(0.006, 0.02, 0.015)


def expected_errors(known: KnownCell, camera: str) -> CameraErrors:
    """Those of a camera of the cell by how it is mounted; one that is not in the cell is taken to be fixed."""
    mounts = [c.mount for c in known.cameras if c.name == camera]
    return CARRIED if any(isinstance(mount, WristMount) for mount in mounts) else FIXED


@dataclass(frozen=True, eq=False)
class Registration:
    """`world_from_camera` and the depth's factor, corrected; `covariance` (7, 7) of position, turn and scale.

    `surprise`: the squared Mahalanobis distance of the correction from the expected errors, 7 degrees of freedom;
    infinite where the camera looks through the faces.
    """

    world_from_camera: RigidTransform
    scale: float
    covariance: FloatArray
    surprise: float

    def point_covariance(self, point: FloatArray) -> FloatArray:
        """Covariance (6, 6) of a pose at `point` (3,) m in the world by the camera's: position m^2, turn rad^2."""
        arm = point - self.world_from_camera.translation
        jacobian = np.zeros((6, 7))
        jacobian[:3, :3] = np.eye(3)
        jacobian[:3, 3:6] = -_cross(arm)
        jacobian[:3, 6] = arm
        jacobian[3:, 3:6] = np.eye(3)
        return np.asarray(jacobian @ self.covariance @ jacobian.T)


def register(
    frame: RgbdFrame, world_from_camera: RigidTransform, boxes: Sequence[Box], errors: CameraErrors
) -> Registration:
    """The camera's pose and depth scale that bring the seen faces of `boxes` home, near to what it was told.

    Without boxes the camera is taken to be where it was told, exactly: poses then stand in its own frame, and its scale
    stays as uncertain as it was.
    """
    if not boxes:
        return Registration(world_from_camera, 1.0, np.diag([0.0] * 6 + [errors.scale**2]), 0.0)
    k = subsampled(frame.intrinsics, STEP)
    depth = frame.depth[::STEP, ::STEP]
    seen_at_all = np.where(np.isfinite(depth) & (depth > 0), depth, 0.0)
    readings = (rays(k) * seen_at_all[..., None]).astype(float)  # (h, w, 3) camera frame, 0 where there is none
    lower = np.array([np.asarray(box.center) - np.asarray(box.size) / 2 for box in boxes])
    upper = np.array([np.asarray(box.center) + np.asarray(box.size) / 2 for box in boxes])
    prior = np.diag(1.0 / np.repeat([errors.position, errors.turn, errors.scale], [3, 3, 1]) ** 2)
    told = world_from_camera.as_matrix()
    turn, place, scale = told[:3, :3], told[:3, 3], 1.0
    information, moved, through = prior, np.zeros(7), 0.0
    for gate in GATES:
        seen, pull, count, through = _equations(scale * readings @ turn.T, place, lower, upper, gate)
        if count < MIN_READINGS:
            break
        information = prior + seen
        step = -np.linalg.solve(information, pull + prior @ moved)
        moved = moved + step
        turn, place, scale = _turn(step[3:6]) @ turn, place + step[:3], scale * (1.0 + float(step[6]))
    pose = RigidTransform(np.vstack([np.column_stack([turn, place]), [0, 0, 0, 1]]), normalize=False)
    covariance = np.asarray(np.linalg.inv(information), float)
    surprise = np.inf if through > MAX_THROUGH else float(moved @ prior @ moved)
    return Registration(pose, scale, covariance, surprise)


@numba.njit(cache=True, error_model="numpy")
def _equations(
    arms: FloatArray, origin: FloatArray, lower: FloatArray, upper: FloatArray, gate: float
) -> tuple[FloatArray, FloatArray, int, float]:
    """Normal equations (7, 7), (7,) of position, turn and scale, how many readings came within the `gate` (m), and the
    share of those on faces that lie `BEHIND` them.

    `arms` (h, w, 3) lead from the camera at `origin` (3,) to the readings, world frame, 0 where there is none; boxes
    reach from `lower` to `upper` (m, 3).
    """
    information, pull, row, count = np.zeros((7, 7)), np.zeros(7), np.zeros(7), 0
    height, width = arms.shape[:2]
    faces, firsts, offs = np.full((height, width), -1), np.zeros((height, width)), np.zeros((height, width))
    met, near, through = np.zeros(6), np.zeros(6), 0
    for v in range(height):
        for u in range(width):
            if arms[v, u, 0] == 0.0 and arms[v, u, 1] == 0.0 and arms[v, u, 2] == 0.0:
                continue
            axis, side, first = _first_face(arms[v, u], origin, lower, upper)
            if axis >= 0:
                off = side * arms[v, u, axis] * (1.0 - first)
                faces[v, u], firsts[v, u], offs[v, u] = 2 * axis + (side > 0), first, off
                met[faces[v, u]] += 1
                through += off < -BEHIND
    told = np.zeros((height, width), np.bool_)
    for v in range(height):
        for u in range(width):
            if faces[v, u] >= 0 and abs(offs[v, u]) < gate and _flat(faces, offs, v, u):
                told[v, u] = True
                near[faces[v, u]] += 1
    for v in range(height):
        for u in range(width):
            face, first, off = faces[v, u], firsts[v, u], offs[v, u]
            if not told[v, u] or near[face] < MIN_SHARE * met[face]:
                continue
            axis, side = face // 2, 1.0 if face % 2 else -1.0
            # Derivatives at the face, not at the reading: noise in both would look like a smaller scale.
            x, y, z = first * arms[v, u, 0], first * arms[v, u, 1], first * arms[v, u, 2]
            row[:] = 0.0
            row[axis] = side
            if axis == 0:
                row[4], row[5] = side * z, -side * y
            elif axis == 1:
                row[3], row[5] = -side * z, side * x
            else:
                row[3], row[4] = side * y, -side * x
            row[6] = side * first * arms[v, u, axis]
            weight = 1.0 / NOISE**2 / (1.0 + (2.0 * off / gate) ** 2)
            count += 1
            for j in range(7):
                pull[j] += weight * off * row[j]
                for k in range(7):
                    information[j, k] += weight * row[j] * row[k]
    return information, pull, count, through / max(1.0, met.sum())


@numba.njit(cache=True, error_model="numpy")
def _flat(faces: NDArray[np.int64], offs: FloatArray, v: int, u: int) -> bool:
    """Whether the readings around one lie as far off its face as it does; not so at the foot of what stands there."""
    for dv, du in ((-AROUND, 0), (AROUND, 0), (0, -AROUND), (0, AROUND)):
        other_v, other_u = v + dv, u + du
        beyond = not (0 <= other_v < faces.shape[0] and 0 <= other_u < faces.shape[1])
        if beyond or faces[other_v, other_u] != faces[v, u]:
            continue
        if abs(offs[other_v, other_u] - offs[v, u]) > UNEVEN:
            return False
    return True


@numba.njit(cache=True, error_model="numpy")
def _first_face(arm: FloatArray, origin: FloatArray, lower: FloatArray, upper: FloatArray) -> tuple[int, float, float]:
    """Axis and side of the box face that the ray `origin` + t * `arm` meets first, and its t; axis -1 at a rim."""
    first, best, outward, at_rim = np.inf, -1, 0.0, False
    for b in range(len(lower)):
        for axis in range(3):
            if lower[b, axis] <= origin[axis] <= upper[b, axis]:
                continue
            side = 1.0 if origin[axis] > upper[b, axis] else -1.0
            face = upper[b, axis] if side > 0 else lower[b, axis]
            t = (face - origin[axis]) / arm[axis]
            if not 0.0 < t < first:
                continue
            inside, rim = True, False
            for other in range(3):
                if other != axis:
                    at = origin[other] + t * arm[other]
                    margin = min(at - lower[b, other], upper[b, other] - at)
                    inside = inside and margin > 0.0
                    rim = rim or margin < BORDER
            if inside:
                first, best, outward, at_rim = t, axis, side, rim
    return (-1 if at_rim else best), outward, first


def _turn(vector: FloatArray) -> FloatArray:
    """The rotation matrix (3, 3) of a rotation vector (3,) rad: Rodrigues' formula."""
    angle = float(np.linalg.norm(vector))
    if angle < 1e-12:
        return np.eye(3)
    k = _cross(vector / angle)
    return np.asarray(np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k)


def _cross(v: FloatArray) -> FloatArray:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
