"""All the evidence at once: colour, silhouette, depth, the connector's size, its cable, and the cell's known faces.

A cylinder of the known size is fitted to the depth readings and to the silhouette of a coloured blob together, each
weighed by its noise. So the estimate of a half-hidden connector is not drawn towards its visible part, and what has the
colour but not the shape is refused.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cell import Box, pose_along
from regrasp.interfaces.frame import RgbdFrame
from regrasp.perception.camera.color import SegmentationParameters, color_mask
from regrasp.perception.camera.registration import (
    CameraErrors,
    Registration,
    RegistrationParameters,
    expected_errors,
    register,
)
from regrasp.perception.pose.cable_end import CableEndParameters
from regrasp.perception.pose.estimate import DEFAULT_AXIS, ROLL_VARIANCE, Estimate, NoEstimate
from regrasp.perception.pose.fused.blob import (
    REALSENSE_D415,
    Blob,
    BlobMask,
    BlobParameters,
    Stereo,
    find_blobs,
    observe,
)
from regrasp.perception.pose.fused.cylinder_fit import CylinderFit, CylinderFitParameters
from regrasp.perception.pose.fused.missing_axis import MissingAxisParameters
from regrasp.perception.pose.fused.multi_start import MultiStartParameters, fit_from_starts, with_doubt
from regrasp.perception.pose.fused.plausibility import (
    PlausibilityParameters,
    refusal,
    too_little,
    visible_ends,
    visible_extent,
)
from regrasp.perception.pose.segmentation import NotSeen


@dataclass(frozen=True)
class FusedParameters:
    """What the technique asks of a frame, and the parameters of its parts."""

    min_readings: int = 12  # depth readings on a blob
    min_silhouette_points: int = 8  # of a blob, in sight
    expected_distance: float = 0.05  # m from where it was last: there a small part will do; choice: half its length
    # Of the camera's correction. Choice: errors as expected exceed it once in a million cameras.
    max_camera_mahalanobis_sq: float = 40.0
    registration: RegistrationParameters = field(default_factory=RegistrationParameters)
    blob: BlobParameters = field(default_factory=BlobParameters)
    fit: CylinderFitParameters = field(default_factory=CylinderFitParameters)
    starts: MultiStartParameters = field(default_factory=MultiStartParameters)
    missing: MissingAxisParameters = field(default_factory=MissingAxisParameters)
    plausibility: PlausibilityParameters = field(default_factory=PlausibilityParameters)
    cable_end: CableEndParameters = field(default_factory=CableEndParameters)


@dataclass(frozen=True, eq=False)
class _Found:
    """A plausible fit in the optical frame; `sign` is +1 where the axis points from cable to tip, 0 if not seen."""

    blob: Blob
    fit: CylinderFit
    whole: bool
    sign: float


@dataclass(frozen=True, eq=False)
class _Refused:
    """A blob that is not the connector, or shows too little of it, and why; see `NoEstimate`."""

    reason: NotSeen
    message: str
    weak_detection: FloatArray | None = None


class Fused:
    """A `Technique`. It knows the connector's colour and size, and the cell's floor and panels."""

    def __init__(self, known: CableKnown, parameters: FusedParameters = FusedParameters()) -> None:
        self._connector, self._boxes, self._parameters = known.cable.connector, known.boxes, parameters
        registration = parameters.registration
        self._errors: dict[str, CameraErrors] = {
            c.name: expected_errors(known, c.name, registration) for c in known.cameras
        }
        noise = parameters.blob.disparity_noise
        self._stereo: dict[str, Stereo] = {c.name: Stereo.of(c, noise) for c in known.cameras}
        self._color = SegmentationParameters.for_color(known.cable.connector.color)

    def estimate(
        self,
        frame: RgbdFrame,
        world_from_camera: RigidTransform,
        *,
        axis: FloatArray | None = None,
        near: FloatArray | None = None,
    ) -> Estimate | NoEstimate:
        """See `Technique.estimate`."""
        blobs = find_blobs(color_mask(frame.rgb, self._color), self._parameters.blob)
        if not blobs:
            message = f"no blob of {self._parameters.blob.min_area} pixels has the connector's colour"
            return NoEstimate(frame.stamp, frame.camera, NotSeen.NO_COLOR, message)
        errors = self._errors.get(frame.camera, self._parameters.registration.fixed_errors)
        camera = register(frame, world_from_camera, self._boxes, errors, self._parameters.registration)
        if camera.mahalanobis_sq > self._parameters.max_camera_mahalanobis_sq:
            message = "the cell's panels are not where the camera's intrinsics, its depth and its place put them"
            return NoEstimate(frame.stamp, frame.camera, NotSeen.NO_CAMERA, message)
        results = [self._find(frame, blob, camera, near) for blob in blobs]
        found = [r for r in results if isinstance(r, _Found)]
        if not found:
            refused = [r for r in results if isinstance(r, _Refused)]
            told = next((r for r in refused if r.weak_detection is not None), refused[0])
            return NoEstimate(frame.stamp, frame.camera, told.reason, told.message, told.weak_detection)
        return _estimate(frame, camera, _choose(found, camera, near), axis)

    def _find(
        self, frame: RgbdFrame, mask: BlobMask, camera: Registration, near: FloatArray | None
    ) -> _Found | _Refused:
        """The connector in one blob, or why it is not there."""
        limits = self._parameters
        stereo = self._stereo.get(frame.camera, REALSENSE_D415)
        blob = observe(frame, mask, camera.scale, stereo, limits.blob)
        if (little := self._too_little_data(blob)) is not None:
            return little
        best, *others = fit_from_starts(blob, self._connector, limits.starts, limits.fit, limits.missing)
        center = camera.world_from_camera.apply(best.center)
        why = refusal(blob, best, limits.plausibility, limits.fit, limits.missing)
        if why is None:
            why = self._inside_known(camera.world_from_camera.translation, center)
        if why is not None:
            return _Refused(NotSeen.NOT_ITS_SHAPE, why)
        whole, leaves = visible_ends(blob, best, limits.plausibility, limits.fit, limits.cable_end)
        if leaves == [False, False]:
            return _Refused(NotSeen.NOT_ITS_SHAPE, "no cable leaves either of its ends")
        expected = near is not None and float(np.linalg.norm(center - near)) < limits.expected_distance
        if True not in leaves and not expected:
            less = too_little(blob, best, limits.plausibility, limits.fit)
            if less is not None:
                return _Refused(NotSeen.TOO_SMALL, f"no cable shows, and {less}", center)
        sign = float(leaves[0] is True) - float(leaves[1] is True)
        return _Found(blob, with_doubt(best, others, limits.starts.doubt_cost), whole, sign)

    def _too_little_data(self, blob: Blob) -> _Refused | None:
        readings, edges = len(blob.observation.points), int(np.count_nonzero(~blob.observation.occluded))
        if readings < self._parameters.min_readings:
            needed = f"{self._parameters.min_readings} are needed"
            return _Refused(NotSeen.NO_DEPTH, f"{readings} depth readings on {blob.area} pixels, {needed}")
        if edges < self._parameters.min_silhouette_points:
            needed = f"{self._parameters.min_silhouette_points} are needed"
            return _Refused(NotSeen.TOO_SMALL, f"{edges} points of its silhouette are in sight, {needed}")
        return None

    def _inside_known(self, camera: FloatArray, center: FloatArray) -> str | None:
        """Why a `center` (3,) m cannot be, seen from `camera` (3,) m: a flat piece on a panel, partly hidden, fits best
        there.
        """
        for box in self._boxes:
            if _behind_face(box, camera, center):
                return f"it would lie within the {box.name.replace('_', ' ')} or behind it"
        return None


def _behind_face(box: Box, camera: FloatArray, point: FloatArray) -> bool:
    """Whether the line from the `camera` (3,) m to a `point` (3,) m enters the box."""
    with np.errstate(divide="ignore", invalid="ignore"):
        low, high = (
            (np.add(box.center, side * np.divide(box.size, 2)) - camera) / (point - camera) for side in (-1, 1)
        )
    enters, leaves = np.nanmax(np.minimum(low, high)), np.nanmin(np.maximum(low, high))
    return bool(0.0 < enters < min(leaves, 1.0))


def _choose(found: list[_Found], camera: Registration, near: FloatArray | None) -> _Found:
    """The one nearest to where it was last, world; the largest where that is not known."""
    if near is None:
        return max(found, key=lambda f: f.blob.area)
    place = camera.world_from_camera.inv().apply(near)
    return min(found, key=lambda f: float(np.linalg.norm(f.fit.center - place)))


def _estimate(frame: RgbdFrame, camera: Registration, found: _Found, hint: FloatArray | None) -> Estimate:
    """The connector that was found, in the world frame; `hint` (3,) decides the axis' sign where nothing shows it."""
    rotation = camera.world_from_camera.rotation
    position, axis = camera.world_from_camera.apply(found.fit.center), rotation.apply(found.fit.axis)
    sign = found.sign or (1.0 if axis @ (DEFAULT_AXIS if hint is None else hint) >= 0 else -1.0)
    spread = np.zeros((6, 5))
    spread[:3, :3] = rotation.as_matrix()
    spread[3:, 3:] = rotation.apply(found.fit.tilt_axes).T
    covariance = spread @ found.fit.covariance @ spread.T + camera.point_covariance(position)
    covariance[3:, 3:] += ROLL_VARIANCE * np.outer(axis, axis)
    x, y, z = position.tolist()
    ax, ay, az = (sign * axis).tolist()
    return Estimate(
        frame.stamp,
        frame.camera,
        position,
        sign * axis,
        pose_along((x, y, z), (ax, ay, az)),
        covariance,
        len(found.blob.observation.points),
        found.blob.area,
        visible_extent(found.blob, found.fit),
        found.whole,
        bool(found.sign),
        camera.world_from_camera,
    )
