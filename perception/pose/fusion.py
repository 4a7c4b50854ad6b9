"""Fuses several estimates of one connector that stands still, by frames of one camera or of several.

Frames of one camera share errors that do not average out: the camera's pose, its depth scale, half of its depth noise.
The errors of different cameras are independent.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.perception.pose.estimate import Estimate

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class FusionParameters:
    """Which estimates count, and how much of their errors they share."""

    # Share of the variance that the frames of one camera have in common. Choice: measured in 27 scenes of six frames,
    # 0.70 of the positions' by the technique `fused`, nearly all of those by `rgbd`.
    common_share: float = 0.8
    # Of the longest visible part. Choice: the centre of a part at least so long is nearly the longest part's.
    min_part_share: float = 0.9
    # Squared Mahalanobis distance beyond which two estimates disagree: 99.9 % of chi-square, 5 degrees of freedom.
    max_mahalanobis_sq: float = 20.515005652432873


def fuse(estimates: Sequence[Estimate], parameters: FusionParameters = FusionParameters()) -> Estimate:
    """One estimate from all of them, with the newest stamp; `camera` lists the cameras, and counts are sums.

    If any estimate is of the whole connector, parts do not count, since a part has another centre. An outlier does not
    count where most agree; where most do not agree, all count alike and the covariance spans them. Which end has the
    cable is decided by the majority of those that saw it.

    Raises:
        ValueError: without an estimate.
    """
    if not estimates:
        raise ValueError("no estimate to fuse")
    counted = [e for e in estimates if e.whole]
    if not counted:
        longest = max(e.extent for e in estimates)
        counted = [e for e in estimates if e.extent >= parameters.min_part_share * longest]
    cameras = sorted({e.camera for e in counted})
    limit = parameters.max_mahalanobis_sq
    of_cameras = [
        _combined([e for e in counted if e.camera == camera], parameters.common_share, limit) for camera in cameras
    ]
    return _combined(of_cameras, 0.0, limit)


def _combined(estimates: Sequence[Estimate], common_share: float, max_mahalanobis_sq: float) -> Estimate:
    """The information-weighted mean of estimates whose errors have this share of the variance in common."""
    line = np.linalg.eigh(sum(np.outer(e.axis, e.axis) for e in estimates))[1][:, -1]
    across = np.linalg.svd(line[None])[2][1:]  # (2, 3): the rotation axes that move the line
    pairs = [_tangent(e, line, across) for e in estimates]
    values, covariances = (np.array(part) for part in zip(*pairs, strict=True))
    kept, agreed = _agreeing(values, covariances, max_mahalanobis_sq)
    mean, covariance = _mean(values[kept], covariances[kept], common_share)
    # Estimates that are sure in nearly the same plane and differ there have their weighted mean far away from all.
    distances = _mahalanobis_sq(mean - values[kept], covariances[kept])
    if not agreed or (len(kept) > 1 and distances.max() > max_mahalanobis_sq):
        mean = values[kept].mean(axis=0)
        covariance = covariances[kept].mean(axis=0) + np.cov(values[kept], rowvar=False, bias=True)
    return _estimate([estimates[i] for i in kept], line, across, mean, covariance)


def _tangent(estimate: Estimate, line: FloatArray, across: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Position, and rotation about `across` (2, 3) from the unit `line` (3,) to the axis; (5,), with covariance (5, 5).

    These are coordinates in the tangent space at `line`, where means are linear.
    """
    turn = _shortest_rotation(line, estimate.axis * (1.0 if estimate.axis @ line >= 0 else -1.0))
    jacobian = np.zeros((5, 6))
    jacobian[:3, :3] = np.eye(3)
    jacobian[3:, 3:] = across @ turn.inv().as_matrix()  # leaves out the unknown roll about the estimate's own axis
    value = np.concatenate([estimate.position, across @ turn.as_rotvec()])
    return value, jacobian @ estimate.covariance @ jacobian.T


def _agreeing(values: FloatArray, covariances: FloatArray, max_mahalanobis_sq: float) -> tuple[list[int], bool]:
    """Which of `values` (n, 5) count, and whether most agree: those near to the most central one, else all."""
    differences = values[:, None] - values
    spread = covariances[:, None] + covariances
    distances = _mahalanobis_sq(differences, spread)
    center = int(np.argmin(np.minimum(distances, max_mahalanobis_sq).sum(axis=1)))
    near = np.flatnonzero(distances[center] < max_mahalanobis_sq).tolist()
    return (near, True) if 2 * len(near) > len(values) else (list(range(len(values))), False)


def _mahalanobis_sq(differences: FloatArray, covariances: FloatArray) -> FloatArray:
    r"""Squared Mahalanobis lengths (...) of vectors (..., n) by `covariances` (..., n, n).

    .. math:: d^2 = x^T \Sigma^{-1} x
    """
    whitened = np.linalg.solve(covariances, differences[..., None])[..., 0]
    return np.asarray(np.einsum("...i,...i->...", differences, whitened))


def _mean(values: FloatArray, covariances: FloatArray, common_share: float) -> tuple[FloatArray, FloatArray]:
    r"""Information-weighted mean (5,) of `values` (n, 5), and its covariance (5, 5).

    .. math:: \bar x = P \sum_i \Sigma_i^{-1} x_i, \quad P = \left(\sum_i \Sigma_i^{-1}\right)^{-1}

    That P holds for independent errors. If all of the error were common, the covariances multiples of each other and
    the weights :math:`w_i` of the sum 1, it would be :math:`(\sum_i \sqrt{w_i})^2` times P: n times for n alike, once
    if one outweighs all. For a common share between, P is scaled linearly.
    """
    informations = np.linalg.inv(covariances)
    covariance = np.linalg.inv(informations.sum(axis=0))
    mean = covariance @ np.einsum("nij,nj->i", informations, values)
    weights = np.einsum("ij,nji->n", covariance, informations) / len(mean)
    all_common = float(np.sqrt(weights).sum()) ** 2
    return mean, covariance * (1.0 - common_share + common_share * all_common)


def _estimate(
    kept: Sequence[Estimate], line: FloatArray, across: FloatArray, mean: FloatArray, covariance: FloatArray
) -> Estimate:
    """The estimate at the tangent coordinates `mean` (5,) of `line`. Its roll is that of the surest estimate."""
    from scipy.spatial.transform import RigidTransform, Rotation

    turn = Rotation.from_rotvec(across.T @ mean[3:])
    line = turn.apply(line)
    axis = line * _sign(kept, line)
    surest = min((e for e in kept if e.axis @ axis >= 0), key=_roll_variance)
    spread = np.zeros((6, 5))
    spread[:3, :3] = np.eye(3)
    spread[3:, 3:] = turn.as_matrix() @ across.T
    full = spread @ covariance @ spread.T
    full[3:, 3:] += _roll_variance(surest) * np.outer(axis, axis)
    rotation = _shortest_rotation(surest.axis, axis) * surest.world_from_connector.rotation
    return Estimate(
        max(e.stamp for e in kept),
        ", ".join(sorted({e.camera for e in kept})),
        mean[:3],
        axis,
        RigidTransform.from_components(mean[:3], rotation),
        full,
        sum(e.points for e in kept),
        sum(e.mask_area for e in kept),
        max(e.extent for e in kept),
        kept[0].whole,
        any(e.sign_seen for e in kept),
    )


def _sign(estimates: Sequence[Estimate], line: FloatArray) -> float:
    """+1 where `line` (3,) points from cable to tip, else -1.

    Decided by the majority of those that saw the cable, then of all, then by the surest axis.
    """
    signs = [1 if e.axis @ line >= 0 else -1 for e in estimates]
    seen = sum(sign for sign, e in zip(signs, estimates, strict=True) if e.sign_seen)
    surest = min(zip(estimates, signs, strict=True), key=lambda pair: float(np.trace(pair[0].covariance[3:, 3:])))[1]
    return float(np.sign(seen or sum(signs) or surest))


def _roll_variance(estimate: Estimate) -> float:
    return float(estimate.axis @ estimate.covariance[3:, 3:] @ estimate.axis)


def _shortest_rotation(start: FloatArray, end: FloatArray) -> "Rotation":
    """The smallest rotation from one unit vector (3,) to another that is not opposite."""
    from scipy.spatial.transform import Rotation

    cross = np.cross(start, end)
    sine = float(np.linalg.norm(cross))
    return Rotation.from_rotvec(cross * (np.arctan2(sine, float(start @ end)) / sine if sine > 0 else 1.0))
