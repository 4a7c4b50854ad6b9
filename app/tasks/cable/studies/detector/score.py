"""How well a detector finds the connector in pictures that it was not trained on: `regrasp evaluate-detector`.

The pictures differ from those of the training in the cell's layout, light and objects. Up to 70 % of the
connector is hidden, measured in its true mask.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from regrasp.app.studies.detector.precision import (
    area_under_curve,
    precision_bounds,
    right_boxes,
    scored_hits,
    true_box,
)
from regrasp.app.tasks.cable.studies.detector.data import axis_in_image
from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.frame import RgbdFrame
from regrasp.perception.detection import PixelBox
from regrasp.perception.pose.detector import Detection, Detector, DetectorParameters
from regrasp.perception.pose.estimate import Estimate
from regrasp.sim.cable.random_scenes.scene import RandomScene, Shot
from regrasp.sim.cameras.depth_noise import DepthNoise
from regrasp.sim.render.renderer import RendererName


@dataclass(frozen=True)
class ScoreParameters:
    """How detections are counted, and which held-out pictures are drawn."""

    min_overlap: float = 0.5  # intersection over union from which a box is right: that of AP50
    min_recorded_score: float = 0.01  # of the boxes in the average precision; choice: far below any that counts
    min_visible_area: int = 100  # px of the camera's picture; choice: a seventh of the connector at 0.75 m
    shots_per_scene: int = 8  # choice
    min_in_plane: float = 0.5  # of the axis' length; choice: along the view its angle in the image says nothing


OCCLUSION = ((0.0, 0.1), (0.1, 0.3), (0.3, 0.5), (0.5, 0.7))  # hidden shares, from and below: a class each
_DEFAULTS = ScoreParameters()


@dataclass(frozen=True)
class ScoredPicture:
    """The detections in one picture, likeliest first, and the ground truth."""

    detections: Sequence[Detection]
    truth: PixelBox | None = None  # around the connector's visible part; None: it is not in the picture
    occlusion: float = 0.0  # share of the connector that is hidden
    angle_error_deg: float | None = None  # of the axis in the image, for the right box; None: no such axis
    position_error: tuple[float, ...] | None = None  # (3,) m, world; None: no pose
    axis_error_deg: float | None = None  # of the pose's axis; None: no pose
    min_overlap: float = ScoreParameters.min_overlap  # from which a box is right

    def correct(self) -> list[bool]:
        """For each detection whether it is the connector; a second box on the connector is wrong."""
        return right_boxes([d.box for d in self.detections], self.truth, self.min_overlap)

    @property
    def detected(self) -> bool:
        """Whether the connector was found with a score that counts."""
        return any(
            right and d.score >= DetectorParameters.min_score
            for d, right in zip(self.detections, self.correct(), strict=True)
        )

    @property
    def false_positives(self) -> int:
        """The number of wrong boxes with a score that counts."""
        return sum(
            d.score >= DetectorParameters.min_score and not right
            for d, right in zip(self.detections, self.correct(), strict=True)
        )


def average_precision(pictures: Sequence[ScoredPicture]) -> float:
    """That of the boxes in all pictures."""
    return area_under_curve(*_hits_and_things(pictures))


def precision_interval(pictures: Sequence[ScoredPicture]) -> tuple[float, float]:
    """The 95 % interval of the average precision."""
    return precision_bounds(*_hits_and_things(pictures))


def _hits_and_things(pictures: Sequence[ScoredPicture]) -> tuple[list[NDArray[np.float64]], NDArray[np.intp]]:
    hits = [scored_hits([d.score for d in a.detections], a.correct()) for a in pictures]
    return hits, np.array([int(a.truth is not None) for a in pictures])


def held_out_shots(
    cell: CableCell,
    seed: int,
    count: int,
    renderer: RendererName = "software",
    report_progress: Callable[[int], None] = lambda _done: None,
    parameters: ScoreParameters = _DEFAULTS,
) -> list[Shot]:
    """`count` pictures of each class in `OCCLUSION`, and as many without the connector.

    `report_progress` is called with the number of pictures kept so far.
    """
    kept: list[list[Shot]] = [[] for _ in (*OCCLUSION, None)]
    first = 0
    while any(len(shots) < count for shots in kept):
        scene = RandomScene(cell, np.random.default_rng([seed, first]), held_out=True, renderer=renderer)
        for i in range(parameters.shots_per_scene):
            shot = scene.shot(present=i > 0, measured=True)
            kind = occlusion_class(shot, parameters.min_visible_area) if i > 0 else len(OCCLUSION)
            if kind is not None and len(kept[kind]) < count:
                kept[kind].append(shot)
                report_progress(sum(map(len, kept)))
        scene.close()
        first += 1
    return [shot for shots in kept for shot in shots]


def occlusion_class(shot: Shot, min_visible_area: int = ScoreParameters.min_visible_area) -> int | None:
    """The index in `OCCLUSION` of the share of the connector that is hidden.

    None where fewer than `min_visible_area` px are visible, or where the connector touches the picture's border: the
    part outside would not be counted as hidden.
    """
    seen, inner = int(np.count_nonzero(shot.mask)), int(np.count_nonzero(shot.mask[1:-1, 1:-1]))
    if inner < max(min_visible_area, seen):
        return None
    return next((i for i, (low, high) in enumerate(OCCLUSION) if low <= shot.occlusion < high), None)


def score_picture(
    detector: Detector, shot: Shot, cell: CableCell, number: int, parameters: ScoreParameters = _DEFAULTS
) -> ScoredPicture:
    """The detections in a picture, and the errors of the pose from it. `number` seeds the depth noise."""
    depth = DepthNoise(shot.camera, cell.hidden.errors, number).apply(shot.depth, 1)
    frame = RgbdFrame(shot.camera.name, number, 0.0, shot.rgb, depth, shot.camera.intrinsics)
    found, truth = detector.detect(frame, parameters.min_recorded_score), true_box(shot.mask)
    if truth is None:
        return ScoredPicture(found)
    out = ScoredPicture(found, truth, shot.occlusion, min_overlap=parameters.min_overlap)
    if not out.detected:
        return out
    best = found[out.correct().index(True)]
    axis = axis_in_image(shot)
    has_angle = float(np.hypot(*axis)) > parameters.min_in_plane
    turned = np.rad2deg(best.angle - np.arctan2(axis[1], axis[0]))
    angle_error = abs((turned + 90) % 180 - 90) if has_angle else None
    true_axis = shot.world_from_connector.rotation.apply([1.0, 0.0, 0.0])
    pose = detector.estimate(frame, shot.world_from_camera, axis=true_axis)
    if not isinstance(pose, Estimate) or not out.correct()[0]:
        return replace(out, angle_error_deg=angle_error)
    error = tuple((pose.position - shot.world_from_connector.translation).tolist())
    axis_error = float(np.rad2deg(np.arccos(np.clip(pose.axis @ true_axis, -1, 1))))
    return replace(out, angle_error_deg=angle_error, position_error=error, axis_error_deg=axis_error)


def detector_figures(pictures: Sequence[ScoredPicture]) -> dict[str, Any]:
    """The figures of evaluation.json: shares as [right, all], quantiles in degrees and m."""
    there = [a for a in pictures if a.truth is not None]
    empty = [a for a in pictures if a.truth is None]
    classes = {f"{low:.0%}-{high:.0%}": [a for a in there if low <= a.occlusion < high] for low, high in OCCLUSION}
    angles = [a.angle_error_deg for a in there if a.angle_error_deg is not None]
    positions = np.array([a.position_error for a in there if a.position_error is not None]).reshape(-1, 3)
    axes = [a.axis_error_deg for a in there if a.axis_error_deg is not None]
    return {
        "schema": 1,
        "ap50": average_precision(pictures),
        "ap50_interval": precision_interval(pictures),
        "min_score": DetectorParameters.min_score,
        "recall": [sum(a.detected for a in there), len(there)],
        "recall_by_occlusion": {name: [sum(a.detected for a in group), len(group)] for name, group in classes.items()},
        "false_boxes": sum(a.false_positives for a in pictures),
        "empty_pictures_with_a_box": [sum(a.false_positives > 0 for a in empty), len(empty)],
        "angle_error_deg": _quantiles(angles),
        "position_error_m": _quantiles(np.linalg.norm(positions, axis=1)),
        "position_deviation_m": _deviation(positions.ravel()),
        "axis_error_deg": _quantiles(axes),
    }


def _quantiles(errors: Sequence[float] | NDArray[np.float64]) -> dict[str, float | None]:
    return {name: float(np.quantile(errors, q)) if len(errors) else None for name, q in (("50%", 0.5), ("95%", 0.95))}


def _deviation(errors: NDArray[np.float64]) -> float | None:
    """The standard deviation of the normal distribution with the same 95 % quantile of absolute errors."""
    return float(np.quantile(np.abs(errors), 0.95) / 1.96) if len(errors) else None
