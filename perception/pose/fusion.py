"""Several estimates of one connector that stands still, by frames of one camera or of several, made one.

Frames of one camera share errors that no number of them averages away: where the camera stands, its depth scale, half
of its depth noise. Cameras are independent of each other.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation
from scipy.stats import chi2

from regrasp.perception.pose.estimate import Estimate

FloatArray = NDArray[np.float64]

# Of the variance is common to a camera's frames of a still scene. Choice: measured in 27 scenes of six frames, 0.70 of
# the positions' by `fused`, nearly all of those by `rgbd`.
COMMON = 0.8
LONG_SHARE = 0.9  # choice: of parts, those that show at least this share of the longest have nearly its centre
FAR = float(chi2.ppf(0.999, 5))  # squared deviations between two estimates: not noise any more


def fuse(estimates: Sequence[Estimate]) -> Estimate:
    """One estimate by all, of the last one's time; `camera` names each, and counts are sums.

    Views of the whole connector count before those of a part, whose centre is another. One that is far off does not
    count where most agree; where they do not, all count alike and the covariance spans them. Which end is which is
    settled by most of those that saw the cable. Raises ValueError without an estimate.
    """
    if not estimates:
        raise ValueError("no estimate to fuse")
    counted = [e for e in estimates if e.whole]
    if not counted:
        longest = max(e.extent for e in estimates)
        counted = [e for e in estimates if e.extent >= LONG_SHARE * longest]
    cameras = sorted({e.camera for e in counted})
    return _combined([_combined([e for e in counted if e.camera == camera], COMMON) for camera in cameras], 0.0)


def _combined(estimates: Sequence[Estimate], common: float) -> Estimate:
    """The information-weighted mean of estimates whose errors have this share of the variance in `common`."""
    line = np.linalg.eigh(sum(np.outer(e.axis, e.axis) for e in estimates))[1][:, -1]
    across = np.linalg.svd(line[None])[2][1:]  # (2, 3): the turns that move the axis
    pairs = [_tangent(e, line, across) for e in estimates]
    values, covariances = (np.array(part) for part in zip(*pairs, strict=True))
    kept, agreed = _agreeing(values, covariances)
    mean, covariance = _mean(values[kept], covariances[kept], common)
    # Estimates that are sure in nearly the same plane and differ there have their weighted mean far away from all.
    if not agreed or (len(kept) > 1 and _squares(mean - values[kept], covariances[kept]).max() > FAR):
        mean = values[kept].mean(axis=0)
        covariance = covariances[kept].mean(axis=0) + np.cov(values[kept], rowvar=False, bias=True)
    return _estimate([estimates[i] for i in kept], line, across, mean, covariance)


def _tangent(estimate: Estimate, line: FloatArray, across: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Position and turns `across` that lead the unit `line` (3,) to the axis, (5,), and their covariance (5, 5)."""
    turn = _turn(line, estimate.axis * (1.0 if estimate.axis @ line >= 0 else -1.0))
    jacobian = np.zeros((5, 6))
    jacobian[:3, :3] = np.eye(3)
    jacobian[3:, 3:] = across @ turn.inv().as_matrix()  # about its own axis nothing is known: that must not leak
    value = np.concatenate([estimate.position, across @ turn.as_rotvec()])
    return value, jacobian @ estimate.covariance @ jacobian.T


def _agreeing(values: FloatArray, covariances: FloatArray) -> tuple[list[int], bool]:
    """Which of `values` (n, 5) count, and whether most agree: those near to the one in the middle, else all."""
    away = values[:, None] - values
    spread = covariances[:, None] + covariances
    squares = _squares(away, spread)
    middle = int(np.argmin(np.minimum(squares, FAR).sum(axis=1)))
    near = np.flatnonzero(squares[middle] < FAR).tolist()
    return (near, True) if 2 * len(near) > len(values) else (list(range(len(values))), False)


def _squares(away: FloatArray, covariances: FloatArray) -> FloatArray:
    """Squared Mahalanobis lengths (...) of vectors (..., n) by `covariances` (..., n, n)."""
    return np.asarray(np.einsum("...i,...i->...", away, np.linalg.solve(covariances, away[..., None])[..., 0]))


def _mean(values: FloatArray, covariances: FloatArray, common: float) -> tuple[FloatArray, FloatArray]:
    """Weighted mean (5,) of `values` (n, 5), and its covariance.

    Were all of the error common and the covariances multiples of each other, with weights w of the sum 1, the mean's
    covariance would be (sum sqrt w)^2 times that of independent errors: n times for n alike, once if one outweighs all.
    """
    informations = np.linalg.inv(covariances)
    covariance = np.linalg.inv(informations.sum(axis=0))
    mean = covariance @ np.einsum("nij,nj->i", informations, values)
    weights = np.einsum("ij,nji->n", covariance, informations) / len(mean)
    alike = float(np.sqrt(weights).sum()) ** 2
    return mean, covariance * (1.0 - common + common * alike)


def _estimate(
    kept: Sequence[Estimate], line: FloatArray, across: FloatArray, mean: FloatArray, covariance: FloatArray
) -> Estimate:
    """The estimate whose axis is `line` turned by what `mean` (5,) says. The roll is that of the surest."""
    turn = Rotation.from_rotvec(across.T @ mean[3:])
    line = turn.apply(line)
    axis = line * _sign(kept, line)
    surest = min((e for e in kept if e.axis @ axis >= 0), key=_roll_variance)
    spread = np.zeros((6, 5))
    spread[:3, :3] = np.eye(3)
    spread[3:, 3:] = turn.as_matrix() @ across.T
    full = spread @ covariance @ spread.T
    full[3:, 3:] += _roll_variance(surest) * np.outer(axis, axis)
    rotation = _turn(surest.axis, axis) * surest.world_from_connector.rotation
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
    """+1 where `line` (3,) points from cable to tip, else -1: by most of those that saw it, then of all."""
    signs = [1 if e.axis @ line >= 0 else -1 for e in estimates]
    seen = sum(sign for sign, e in zip(signs, estimates, strict=True) if e.sign_seen)
    surest = min(zip(estimates, signs, strict=True), key=lambda pair: float(np.trace(pair[0].covariance[3:, 3:])))[1]
    return float(np.sign(seen or sum(signs) or surest))


def _roll_variance(estimate: Estimate) -> float:
    return float(estimate.axis @ estimate.covariance[3:, 3:] @ estimate.axis)


def _turn(start: FloatArray, end: FloatArray) -> Rotation:
    """The least turn that leads one unit vector (3,) to another that is not opposite."""
    cross = np.cross(start, end)
    sine = float(np.linalg.norm(cross))
    return Rotation.from_rotvec(cross * (np.arctan2(sine, float(start @ end)) / sine if sine > 0 else 1.0))
