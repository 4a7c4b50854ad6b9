"""True boxes, which of a detector's boxes are right, their average precision, and its interval."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.arrays import Mask
from regrasp.perception.detection import PixelBox, intersection_over_union

Hits = NDArray[np.float64]  # (n, 2): of each box in a picture its score, and 1 if it is right, else 0


def true_box(mask: Mask) -> PixelBox | None:
    """The box (u0, v0, u1, v1) px around a mask (H, W), None if it is empty. Pixel u covers u - 0.5 to u + 0.5."""
    if not mask.any():
        return None
    u, v, width, height = cv2.boundingRect(mask.astype(np.uint8))
    return u - 0.5, v - 0.5, u + width - 0.5, v + height - 0.5


def right_boxes(boxes: Sequence[PixelBox], truth: PixelBox | None, min_overlap: float) -> list[bool]:
    """For each of the boxes, likeliest first, whether it is the thing; a second box on the thing is wrong."""
    out: list[bool] = []
    for box in boxes:
        fits = truth is not None and intersection_over_union(box, truth) >= min_overlap
        out.append(fits and not any(out))
    return out


def scored_hits(scores: Sequence[float], right: Sequence[bool]) -> Hits:
    """`Hits` of one picture."""
    return np.array(list(zip(scores, right, strict=True)), float).reshape(-1, 2)


def area_under_curve(pictures: Sequence[Hits], things: NDArray[np.intp]) -> float:
    r"""The average precision: the area under the precision-recall curve (all points, as in PASCAL VOC 2010).

    .. math:: AP = \sum_i (r_i - r_{i-1}) \max_{j \ge i} p_j

    with precision p and recall r after the i likeliest boxes of all pictures. `things` (n,) counts what there was to
    find in each.
    """
    return _area(np.concatenate([np.empty((0, 2)), *pictures]), int(things.sum()))


def precision_bounds(pictures: Sequence[Hits], things: NDArray[np.intp], samples: int = 1000) -> tuple[float, float]:
    """The 95 % interval of `area_under_curve` by the percentile bootstrap over pictures (Efron 1979).

    `samples` resamplings; choice: the interval's ends are then known to a tenth of its width.
    """
    rng, areas = np.random.default_rng(0), []
    for _ in range(samples):
        some = rng.integers(len(pictures), size=len(pictures))
        areas.append(_area(np.concatenate([pictures[i] for i in some]), int(things[some].sum())))
    low, high = np.quantile(areas, [0.025, 0.975]).tolist()
    return low, high


def _area(hits: Hits, total: int) -> float:
    if not len(hits) or not total:
        return 0.0
    right = hits[np.argsort(-hits[:, 0], kind="stable"), 1]
    recall = np.cumsum(right) / total
    precision = np.cumsum(right) / np.arange(1, len(right) + 1)
    falling = np.maximum.accumulate(precision[::-1])[::-1]
    return float(np.sum(np.diff(recall, prepend=0.0) * falling))
