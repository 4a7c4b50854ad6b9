"""How well a detector finds the printed part in pictures unlike those of its training: other light, cells, renderer."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from regrasp.app.studies.detector.precision import (
    Hits,
    area_under_curve,
    precision_bounds,
    right_boxes,
    scored_hits,
    true_box,
)
from regrasp.interfaces.printer.actions import CLASSES, PartClass
from regrasp.interfaces.printer.cell import PrinterCell
from regrasp.perception.detection import PixelBox, intersection_over_union
from regrasp.perception.printer.detector import PartDetection, PartDetector, PartDetectorParameters
from regrasp.sim.printer.random_scene import PartScene, PartShot
from regrasp.sim.render.renderer import RendererName

MIN_RECORDED_SCORE = 0.01  # of the boxes in the average precision; choice: far below any that counts
Truth = PixelBox | None


@dataclass(frozen=True)
class ScoreParameters:
    """How detections are counted, and which held-out pictures are drawn."""

    min_overlap: float = 0.5  # intersection over union from which a box is right: that of AP50
    min_visible_area: int = 100  # px of the camera's picture; choice: a sixth of the section at 0.7 m
    max_occlusion: float = 0.7  # share of the part that may be hidden; choice
    shots_per_scene: int = 6  # choice
    absent_every: int = 4  # one picture of so many shows no part; choice


@dataclass(frozen=True)
class ScoredPicture:
    """The detections in one picture, and the true box of each class; classes of which too little is seen are not in."""

    detections: Sequence[PartDetection]
    truths: dict[PartClass, Truth]


def held_out_shots(
    cell: PrinterCell,
    seed: int,
    count: int,
    renderer: RendererName = "software",
    report_progress: Callable[[int], None] = lambda _done: None,
    parameters: ScoreParameters = ScoreParameters(),
) -> list[PartShot]:
    """`count` pictures with another chamber, other light and other clutter than those of the training."""
    shots: list[PartShot] = []
    while len(shots) < count:
        scene = PartScene(cell, np.random.default_rng([seed, len(shots)]), held_out=True, renderer=renderer)
        for _ in range(min(parameters.shots_per_scene, count - len(shots))):
            present = (len(shots) + 1) % parameters.absent_every != 0
            shots.append(scene.shot(present, measured=True))
            report_progress(len(shots))
        scene.close()
    return shots


def scored(detector: PartDetector, shot: PartShot, parameters: ScoreParameters = ScoreParameters()) -> ScoredPicture:
    """What a detector finds in a picture, and what there is."""
    truths: dict[PartClass, Truth] = {}
    for name in CLASSES:
        mask = shot.masks[name]
        hidden = name in ("obj", "targ") and shot.occlusion > parameters.max_occlusion
        if mask.any() and (hidden or np.count_nonzero(mask) < parameters.min_visible_area):
            continue
        truths[name] = true_box(mask)
    return ScoredPicture(detector.detect(shot.rgb, MIN_RECORDED_SCORE), truths)


def hits_of(
    name: PartClass,
    detections: Sequence[PartDetection],
    truth: Truth,
    min_overlap: float = ScoreParameters.min_overlap,
) -> Hits:
    """The boxes of one class in a picture, and whether they are right."""
    found = [d for d in detections if d.name == name]
    return scored_hits([d.score for d in found], right_boxes([d.box for d in found], truth, min_overlap))


def part_detector_figures(
    pictures: Sequence[ScoredPicture], parameters: ScoreParameters = ScoreParameters()
) -> dict[str, Any]:
    """The figures of evaluation.json: of each class AP50 with its interval, and shares as [right, all]."""
    least, classes = PartDetectorParameters.min_score, {}
    for name in CLASSES:
        shown = [a for a in pictures if name in a.truths]
        hits = [hits_of(name, a.detections, a.truths[name], parameters.min_overlap) for a in shown]
        things = np.array([int(a.truths[name] is not None) for a in shown])
        found = [bool(((h[:, 0] >= least) & (h[:, 1] > 0)).any()) for h in hits]
        false = [bool(((h[:, 0] >= least) & (h[:, 1] == 0)).any()) for h in hits]
        overlaps = [
            max(intersection_over_union(d.box, a.truths[name]) for d in a.detections if d.name == name)  # type: ignore[arg-type]
            for a, there, right in zip(shown, things, found, strict=True)
            if there and right
        ]
        classes[name] = {
            "ap50": area_under_curve(hits, things),
            "ap50_interval": precision_bounds(hits, things),
            "recall": [sum(found), int(things.sum())],
            "pictures_with_a_false_box": [sum(false), len(shown)],
            "median_overlap": float(np.median(overlaps)) if overlaps else None,
        }
    mean = float(np.mean([each["ap50"] for each in classes.values()]))
    return {"schema": 1, "pictures": len(pictures), "min_score": least, "map50": mean, "classes": classes}
