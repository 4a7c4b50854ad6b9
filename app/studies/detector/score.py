"""How well a detector does on pictures that it was not trained on: `regrasp evaluate-detector`.

The pictures show another layout of the cell, other light and other things than those of the training, drawn by the
other renderer; the connector is hidden by up to 70 %, measured from its true mask.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from regrasp.app.studies.detector.data import axis_in_image
from regrasp.interfaces.cell import Cell
from regrasp.interfaces.frame import RgbdFrame
from regrasp.perception.pose.detector import Detection, Detector, DetectorParameters, PixelBox, intersection_over_union
from regrasp.perception.pose.estimate import Estimate
from regrasp.sim.cameras.depth_noise import DepthNoise
from regrasp.sim.random_scenes.scene import RandomScene, Shot
from regrasp.sim.render.renderer import RendererName

MATCH = 0.5  # intersection over union from which a box counts as right: that of AP50
LEAST_SCORE = 0.01  # of the boxes that enter the average precision; choice: far below any that counts
LEAST_SEEN = 100  # px of the camera's picture; choice: a seventh of the connector at 0.75 m; less is left out
OCCLUSION = ((0.0, 0.1), (0.1, 0.3), (0.3, 0.5), (0.5, 0.7))
SHOTS = 8  # of one scene
RESAMPLED = 1000  # times, for an interval; choice: its ends then hold to a tenth of its width
SEEN_ACROSS = 0.5  # of its length: the axis of a connector seen along it says nothing in the image


@dataclass(frozen=True)
class Answer:
    """What was found in one picture, and what there was: the visible part's box, None for none; how much was hidden.

    `angle_error_deg`: of the right box's axis in the image; `position_error`: m, world, (3,); `axis_error_deg`: of the
    pose; None where there is none.
    """

    found: Sequence[Detection]
    truth: PixelBox | None = None
    occlusion: float = 0.0
    angle_error_deg: float | None = None
    position_error: tuple[float, ...] | None = None
    axis_error_deg: float | None = None

    def right(self) -> list[bool]:
        """Of each detection, likeliest first, whether it is the connector; a second one on it is not."""
        out: list[bool] = []
        for detection in self.found:
            fits = self.truth is not None and intersection_over_union(detection.box, self.truth) >= MATCH
            out.append(fits and not any(out))
        return out

    @property
    def seen(self) -> bool:
        """Whether the connector was found with a score that counts."""
        return any(
            right and d.score >= DetectorParameters.min_score for d, right in zip(self.found, self.right(), strict=True)
        )

    @property
    def false(self) -> int:
        """Boxes with a score that counts on what is no connector."""
        return sum(
            d.score >= DetectorParameters.min_score and not right
            for d, right in zip(self.found, self.right(), strict=True)
        )


def average_precision(answers: Sequence[Answer]) -> float:
    """Area under the curve of precision, made to fall, over recall (all points)."""
    return _area(np.vstack([np.empty((0, 2)), *map(_hits, answers)]), sum(a.truth is not None for a in answers))


def precision_interval(answers: Sequence[Answer]) -> tuple[float, float]:
    """The 95 % interval of the average precision by the bootstrap: as many pictures drawn from these, often."""
    hits, there = [_hits(a) for a in answers], np.array([a.truth is not None for a in answers])
    rng, areas = np.random.default_rng(0), []
    for _ in range(RESAMPLED):
        some = rng.integers(len(answers), size=len(answers))
        areas.append(_area(np.concatenate([hits[i] for i in some]), int(there[some].sum())))
    low, high = np.quantile(areas, [0.025, 0.975]).tolist()
    return low, high


def _hits(answer: Answer) -> NDArray[np.float64]:
    """Of each box its score and whether it is right, 1 or 0; (n, 2)."""
    return np.array([(d.score, r) for d, r in zip(answer.found, answer.right(), strict=True)], float).reshape(-1, 2)


def _area(hits: NDArray[np.float64], total: int) -> float:
    """See `average_precision`: of boxes (n, 2), score and rightness, and so many connectors."""
    if not len(hits) or not total:
        return 0.0
    right = hits[np.argsort(-hits[:, 0], kind="stable"), 1]
    recall = np.cumsum(right) / total
    precision = np.cumsum(right) / np.arange(1, len(right) + 1)
    falling = np.maximum.accumulate(precision[::-1])[::-1]
    return float(np.sum(np.diff(recall, prepend=0.0) * falling))


def held_out_shots(
    cell: Cell, seed: int, count: int, renderer: RendererName = "tiny", tell: Callable[[int], None] = lambda _done: None
) -> list[Shot]:
    """`count` pictures of each class of occlusion, and as many without the connector."""
    kept: list[list[Shot]] = [[] for _ in (*OCCLUSION, None)]
    first = 0
    while any(len(shots) < count for shots in kept):
        scene = RandomScene(cell, np.random.default_rng([seed, first]), held_out=True, renderer=renderer)
        for i in range(SHOTS):
            shot = scene.shot(present=i > 0, measured=True)
            kind = occlusion_class(shot) if i > 0 else len(OCCLUSION)
            if kind is not None and len(kept[kind]) < count:
                kept[kind].append(shot)
                tell(sum(map(len, kept)))
        scene.close()
        first += 1
    return [shot for shots in kept for shot in shots]


def occlusion_class(shot: Shot) -> int | None:
    """The index in `OCCLUSION` of how much of the connector is hidden; None where too little shows.

    None, too, at the picture's rim: how much of it lies beyond is not counted.
    """
    seen, inner = int(np.count_nonzero(shot.mask)), int(np.count_nonzero(shot.mask[1:-1, 1:-1]))
    if inner < max(LEAST_SEEN, seen):
        return None
    return next((i for i, (low, high) in enumerate(OCCLUSION) if low <= shot.occlusion < high), None)


def true_box(mask: NDArray[np.bool_]) -> PixelBox | None:
    """The box (u0, v0, u1, v1) around a mask (H, W), px, pixel u covering u - 0.5 to u + 0.5; None if it is empty."""
    if not mask.any():
        return None
    u, v, width, height = cv2.boundingRect(mask.astype(np.uint8))
    return u - 0.5, v - 0.5, u + width - 0.5, v + height - 0.5


def answer(detector: Detector, shot: Shot, cell: Cell, number: int) -> Answer:
    """What the detector says to a picture, whose depth gets the noise of seed and frame `number`."""
    depth = DepthNoise(shot.camera, cell.hidden.errors, number).apply(shot.depth, 1)
    frame = RgbdFrame(shot.camera.name, number, 0.0, shot.rgb, depth, shot.camera.intrinsics)
    found, truth = detector.detect(frame, LEAST_SCORE), true_box(shot.mask)
    if truth is None:
        return Answer(found)
    out = Answer(found, truth, shot.occlusion)
    if not out.seen:
        return out
    best = found[out.right().index(True)]
    axis = axis_in_image(shot)
    across = float(np.hypot(*axis)) > SEEN_ACROSS
    turned = np.rad2deg(best.angle - np.arctan2(axis[1], axis[0]))
    angle_error = abs((turned + 90) % 180 - 90) if across else None
    true_axis = shot.world_from_connector.rotation.apply([1.0, 0.0, 0.0])
    pose = detector.estimate(frame, shot.world_from_camera, axis=true_axis)
    if not isinstance(pose, Estimate) or not out.right()[0]:
        return Answer(found, truth, out.occlusion, angle_error)
    error = tuple((pose.position - shot.world_from_connector.translation).tolist())
    off = float(np.rad2deg(np.arccos(np.clip(pose.axis @ true_axis, -1, 1))))
    return Answer(found, truth, out.occlusion, angle_error, error, off)


def summary(answers: Sequence[Answer]) -> dict[str, Any]:
    """The figures, ready for JSON: shares as [right, all]."""
    there = [a for a in answers if a.truth is not None]
    empty = [a for a in answers if a.truth is None]
    classes = {f"{low:.0%}-{high:.0%}": [a for a in there if low <= a.occlusion < high] for low, high in OCCLUSION}
    angles = [a.angle_error_deg for a in there if a.angle_error_deg is not None]
    positions = np.array([a.position_error for a in there if a.position_error is not None]).reshape(-1, 3)
    axes = [a.axis_error_deg for a in there if a.axis_error_deg is not None]
    return {
        "schema": 1,
        "ap50": average_precision(answers),
        "ap50_interval": precision_interval(answers),
        "min_score": DetectorParameters.min_score,
        "recall": [sum(a.seen for a in there), len(there)],
        "recall_by_occlusion": {name: [sum(a.seen for a in group), len(group)] for name, group in classes.items()},
        "false_boxes": sum(a.false for a in answers),
        "empty_pictures_with_a_box": [sum(a.false > 0 for a in empty), len(empty)],
        "angle_error_deg": _quantiles(angles),
        "position_error_m": _quantiles(np.linalg.norm(positions, axis=1)),
        "position_deviation_m": _deviation(positions.ravel()),
        "axis_error_deg": _quantiles(axes),
    }


def _quantiles(errors: Sequence[float] | NDArray[np.float64]) -> dict[str, float | None]:
    return {name: float(np.quantile(errors, q)) if len(errors) else None for name, q in (("50%", 0.5), ("95%", 0.95))}


def _deviation(errors: NDArray[np.float64]) -> float | None:
    """The standard deviation of the normal distribution that has as many errors within its 95 % as these."""
    return float(np.quantile(np.abs(errors), 0.95) / 1.96) if len(errors) else None
