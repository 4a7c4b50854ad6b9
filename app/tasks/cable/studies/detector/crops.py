"""Random crops of training pictures, augmented, and the target maps that the detector should answer for them.

The augmentation is that of Hwang 2024, section 3.2.2: flips, turns by 90 and up to 15 degrees, crops, shear 15 degrees,
hue +-25 degrees, saturation, brightness and exposure 25 %, blur, noise 5 %, three cutouts of 10 %, mosaic.
"""

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from regrasp.app.studies.detector.recoloring import RecoloringParameters, recolored
from regrasp.app.studies.detector.wanted import wanted_maps
from regrasp.app.tasks.cable.studies.detector.data import Pictures
from regrasp.perception.pose.detector import NETWORK_HEIGHT, NETWORK_WIDTH


@dataclass(frozen=True)
class AugmentationParameters:
    """How crops are cut from pictures and changed at random (Hwang 2024, section 3.2.2). Shares are probabilities."""

    crop_size: int = 160  # px; choice: crops, mostly near the connector, teach more per second than whole pictures
    min_visible_area: int = 24  # px of the small picture; choice: corners of 6 output cells; less is not trained on
    connector_share: float = 0.6  # crops cut near the connector; choice
    look_alike_share: float = 0.3  # crops cut near its colour elsewhere; choice
    no_depth_share: float = 0.05  # crops without any depth; choice
    mosaic_share: float = 0.15  # crops made of four smaller ones; choice
    place: tuple[float, float] = (0.1, 0.9)  # of the crop's edges: where the chosen pixel comes to lie; choice
    max_turn: float = 15.0  # degrees; Hwang's
    quarter_turn_share: float = 0.3  # crops turned by 0 to 3 quarter turns more; choice
    max_shear: float = 15.0  # degrees, along each axis; Hwang's
    shear_share: float = 0.3  # choice
    zoom: tuple[float, float] = (0.75, 1.4)  # choice: Hwang's crops take off up to a fifth, and as much smaller
    cutout_share: float = 0.5  # crops with parts covered; choice
    cutouts: int = 3  # rectangles; Hwang's
    cutout_fraction: int = 10  # a rectangle's edges are this fraction, one tenth, of a whole picture's; Hwang's
    cutout_depth: tuple[float, float] = (0.6, 1.0)  # a cutout's depth over that of what it covers; choice
    recoloring: RecoloringParameters = field(default_factory=RecoloringParameters)


@dataclass(frozen=True)
class Target:
    """A connector in a crop.

    `box` (u0, v0, u1, v1) px around its visible part; `axis` (2,) as in `Pictures`; `counts`: whether enough of it is
    visible to train on.
    """

    box: tuple[float, float, float, float]
    axis: tuple[float, float]
    counts: bool


def draw_crop(
    pictures: Pictures,
    rng: np.random.Generator,
    parameters: AugmentationParameters = AugmentationParameters(),
) -> tuple[NDArray[np.uint8], NDArray[np.float32], list[Target]]:
    """A random crop: image (160, 160, 3) RGB, `pixel_sizes` (80, 80) in m, and the connectors in it."""
    size, half = parameters.crop_size, parameters.crop_size // 2
    if rng.random() >= parameters.mosaic_share:
        image, sizes, targets = _cut_crop(pictures, rng, size, parameters)
        return recolored(image, rng, parameters.recoloring), sizes, targets
    out, out_sizes = np.zeros((size, size, 3), np.uint8), np.zeros((half, half), np.float32)
    all_targets = []
    for u, v in ((0, 0), (half, 0), (0, half), (half, half)):
        in_image, in_sizes = ((slice(v // n, (v + half) // n), slice(u // n, (u + half) // n)) for n in (1, 2))
        out[in_image], out_sizes[in_sizes], targets = _cut_crop(pictures, rng, half, parameters)
        for t in targets:
            box = (t.box[0] + u, t.box[1] + v, t.box[2] + u, t.box[3] + v)
            all_targets.append(Target(box, t.axis, t.counts))
    return recolored(out, rng, parameters.recoloring), out_sizes, all_targets


def _cut_crop(
    pictures: Pictures, rng: np.random.Generator, size: int, parameters: AugmentationParameters
) -> tuple[NDArray[np.uint8], NDArray[np.float32], list[Target]]:
    """A square crop of `size` px, rotated, zoomed, sheared and mirrored, with parts cut out."""
    i = int(rng.integers(len(pictures.images)))
    image, mask = pictures.images[i], pictures.masks[i]
    middle = _crop_middle(pictures, i, rng, parameters)
    change = _linear_change(rng, parameters)
    matrix = np.column_stack([change, rng.uniform(*parameters.place, 2) * size - change @ middle])
    image = cv2.warpAffine(image, matrix, (size, size), flags=cv2.INTER_LINEAR)
    mask = cv2.warpAffine(mask, matrix, (size, size), flags=cv2.INTER_LINEAR)
    zoom = float(np.sqrt(abs(np.linalg.det(change))))
    # `matrix` for every second pixel, without a shift by half a pixel: a reading belongs to the upper left of its four.
    halved = np.column_stack([change, matrix[:, 2] / 2])
    sizes = cv2.warpAffine(pictures.sizes[i], halved, (size // 2, size // 2), flags=cv2.INTER_NEAREST)
    sizes = sizes * np.float32(1e-6 / zoom)
    if rng.random() < parameters.no_depth_share:
        sizes[:] = 0.0
    _cut_out(image, sizes, mask, rng, parameters)
    return image, sizes, _targets(np.asarray(mask >= 128, np.uint8), change, pictures.axes[i], parameters)


def _crop_middle(
    pictures: Pictures, i: int, rng: np.random.Generator, parameters: AugmentationParameters
) -> NDArray[np.float64]:
    """The pixel (u, v) of picture `i` to crop around: on the connector, on a look-alike, or anywhere."""
    middle, draw = rng.uniform([0, 0], [NETWORK_WIDTH, NETWORK_HEIGHT]), float(rng.random())
    look_alike = pictures.look_alikes[i, rng.integers(pictures.look_alikes.shape[1])]
    if draw < parameters.connector_share and pictures.masks[i].any():
        u, v, width, height = cv2.boundingRect(pictures.masks[i])
        return np.array([u + width / 2, v + height / 2])
    if draw < parameters.connector_share + parameters.look_alike_share and look_alike[0] >= 0:
        return np.asarray(look_alike, np.float64)
    return middle


def _targets(
    mask: NDArray[np.uint8],
    change: NDArray[np.float64],
    axis: NDArray[np.float32],
    parameters: AugmentationParameters,
) -> list[Target]:
    """The connector of a crop, if any of it is visible: `axis` (2,) is its axis before the `change` (2, 2)."""
    area = cv2.countNonZero(mask)
    if not area:
        return []
    u, v, width, height = cv2.boundingRect(mask)
    changed = change @ axis
    changed *= np.linalg.norm(axis) / max(float(np.linalg.norm(changed)), 1e-9)
    counts = area >= parameters.min_visible_area
    return [Target((u, v, u + width, v + height), tuple(changed.tolist()), counts)]


def _linear_change(rng: np.random.Generator, parameters: AugmentationParameters) -> NDArray[np.float64]:
    """A random matrix (2, 2) on pixels: mirror, quarter turns, turn, shear and zoom."""
    angle = np.deg2rad(rng.uniform(-parameters.max_turn, parameters.max_turn)) + np.pi / 2 * rng.integers(4) * (
        rng.random() < parameters.quarter_turn_share
    )
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    shear = np.eye(2)
    if rng.random() < parameters.shear_share:
        shear[0, 1], shear[1, 0] = np.tan(np.deg2rad(rng.uniform(-parameters.max_shear, parameters.max_shear, 2)))
    zoom = np.exp(rng.uniform(np.log(parameters.zoom[0]), np.log(parameters.zoom[1])))
    return np.asarray(zoom * turn @ shear @ np.diag([rng.choice([-1.0, 1.0]), 1.0]))


def _cut_out(
    image: NDArray[np.uint8],
    sizes: NDArray[np.float32],
    mask: NDArray[np.uint8],
    rng: np.random.Generator,
    parameters: AugmentationParameters,
) -> None:
    """Cover some rectangles with plain colours, in place; their depth becomes nearer or has no reading."""
    if rng.random() < 1 - parameters.cutout_share:
        return
    height, width = NETWORK_HEIGHT // parameters.cutout_fraction, NETWORK_WIDTH // parameters.cutout_fraction
    for _ in range(parameters.cutouts):
        u, v = rng.integers(0, image.shape[0], 2)
        cutout = slice(v, v + height), slice(u, u + width)
        image[cutout], mask[cutout] = rng.integers(0, 256, 3), 0
        depth_ratio = rng.choice([0.0, rng.uniform(*parameters.cutout_depth)])
        sizes[v // 2 : (v + height) // 2, u // 2 : (u + width) // 2] = depth_ratio * sizes[v // 2, u // 2]


def target_maps(targets: list[Target], size: int = AugmentationParameters.crop_size) -> NDArray[np.float32]:
    """What the network should answer for a crop of `size` px: (9, n, n) for n = size / 8 cells along an edge.

    Maps 0 to 6 are those of `regrasp.perception.pose.detector.decode`, the last two the weights of `wanted_maps`.
    """
    return wanted_maps([(t.box, t.counts, _axis_values(t.axis)) for t in targets], (size, size), values=6)


def _axis_values(axis: tuple[float, float]) -> tuple[float, float]:
    """in_plane^2 (cos 2 angle, sin 2 angle) of an axis in the image; see `decode`."""
    angle, length = np.arctan2(axis[1], axis[0]), float(np.hypot(*axis)) ** 2
    return float(length * np.cos(2 * angle)), float(length * np.sin(2 * angle))
