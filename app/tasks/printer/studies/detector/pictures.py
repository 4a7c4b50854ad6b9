"""Training pictures of the printed part at the network's resolution, with their true boxes, and changes of them."""

from collections.abc import Callable
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from regrasp.app.studies.detector.precision import true_box
from regrasp.app.studies.detector.recoloring import recolored
from regrasp.app.studies.detector.wanted import Thing, wanted_maps
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.printer.actions import CLASSES
from regrasp.interfaces.printer.cell import PrinterCell
from regrasp.perception.detection import letterboxed
from regrasp.perception.printer.detector import MIRRORED, NETWORK_SHAPE
from regrasp.sim.printer.random_scene import PartScene, PartSceneParameters


@dataclass(frozen=True)
class PictureParameters:
    """How the pictures are drawn and changed. Shares are probabilities. All values are choices."""

    shots_per_scene: int = 12  # to make a scene costs as much as to draw six pictures
    absent_every: int = 6  # one picture of so many shows look-alikes, but no part
    min_visible_area: int = 80  # px of the camera's picture; of less nothing is learned
    # Something hides more of the part than in the pictures of an evaluation: half hidden parts are the hard ones.
    scene: PartSceneParameters = field(
        default_factory=lambda: PartSceneParameters(occluded_share=0.75, shown_share=0.45)
    )
    mirrored_share: float = 0.5
    zoom: tuple[float, float] = (0.75, 1.35)
    shift: float = 0.15  # of the picture's edges, to each side
    min_box_share: float = 0.3  # of a box's area that must stay in the changed picture


@dataclass(frozen=True, eq=False)
class PartPictures:
    """n small pictures, as the network sees them, and what they show.

    `images` (n, 320, 416, 3) uint8, RGB. `boxes` (n, 4, 4) px, of each class, from the picture's corner; NaN for one
    that it does not show. `counts` (n, 4): whether enough of it is seen.
    """

    images: NDArray[np.uint8]
    boxes: NDArray[np.float32]
    counts: NDArray[np.bool_]

    def part(self, first: int, after: int) -> "PartPictures":
        """Pictures `first` to `after` - 1, not copied."""
        chosen = slice(first, after)
        return PartPictures(self.images[chosen], self.boxes[chosen], self.counts[chosen])


def make_pictures(
    cell: PrinterCell,
    seed: int,
    count: int,
    report_progress: Callable[[int], None] = lambda _done: None,
    parameters: PictureParameters = PictureParameters(),
) -> PartPictures:
    """`count` pictures of scenes drawn from `seed`; `report_progress` is called with the number drawn so far."""
    out = PartPictures(
        np.zeros((count, *NETWORK_SHAPE, 3), np.uint8),
        np.full((count, len(CLASSES), 4), np.nan, np.float32),
        np.zeros((count, len(CLASSES)), np.bool_),
    )
    for first in range(0, count, parameters.shots_per_scene):
        scene = PartScene(cell, np.random.default_rng([seed, first]), parameters=parameters.scene)
        for i in range(first, min(first + parameters.shots_per_scene, count)):
            shot = scene.shot(present=(i + 1) % parameters.absent_every != 0)
            out.images[i], scale = letterboxed(shot.rgb, NETWORK_SHAPE)
            for k, name in enumerate(CLASSES):
                if (box := true_box(shot.masks[name])) is not None:
                    out.boxes[i, k] = scale * (np.array(box) + 0.5)
                    out.counts[i, k] = np.count_nonzero(shot.masks[name]) >= parameters.min_visible_area
            report_progress(i + 1)
        scene.close()
    return out


def changed(
    pictures: PartPictures, i: int, rng: np.random.Generator, parameters: PictureParameters = PictureParameters()
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Picture `i`, shifted, zoomed, mirrored and in other colours, and its `wanted_maps` (4, 7, h / 8, w / 8)."""
    height, width = NETWORK_SHAPE
    mirrored = rng.random() < parameters.mirrored_share
    zoom = float(np.exp(rng.uniform(*np.log(parameters.zoom))))
    middle, shift = np.array([width, height]) / 2, parameters.shift * rng.uniform(-1, 1, 2) * [width, height]
    # By edges of pixels: a point p becomes scale * (p - middle) + middle + shift.
    scale = np.array([-zoom if mirrored else zoom, zoom])
    offset = middle + shift - scale * middle
    matrix = np.array([[scale[0], 0.0, offset[0]], [0.0, scale[1], offset[1]]])
    matrix[:, 2] += 0.5 * scale - 0.5  # by middles of pixels
    image = cv2.warpAffine(pictures.images[i], matrix, (width, height), flags=cv2.INTER_LINEAR)
    ends = pictures.boxes[i].reshape(-1, 2, 2) * scale + offset
    boxes = np.hstack([ends.min(axis=1), ends.max(axis=1)])
    order = MIRRORED if mirrored else range(len(CLASSES))
    maps = [
        wanted_maps(_inside(boxes[k], bool(pictures.counts[i, k]), parameters.min_box_share), NETWORK_SHAPE)
        for k in order
    ]
    return recolored(np.asarray(image, np.uint8), rng), np.stack(maps)


def _inside(box: FloatArray, counts: bool, least: float) -> list[Thing]:
    """The part of a box that lies in the picture; it counts if it has the share `least` of the box."""
    height, width = NETWORK_SHAPE
    seen = np.clip(box, 0.0, [width, height, width, height])
    edges, whole = seen[2:] - seen[:2], box[2:] - box[:2]
    if not (edges > 0.5).all():  # NaN compares false
        return []
    return [(tuple(seen.tolist()), counts and float(edges.prod()) >= least * float(whole.prod()), ())]
