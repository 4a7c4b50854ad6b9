"""What the detector is trained on: random pictures of a cell, as small as the network sees them, and changes of them.

The changes are those of Hwang 2024, section 3.2.2: flips, turns by 90 and up to 15 degrees, crops, shear 15 degrees,
hue +-25 degrees, saturation, brightness and exposure 25 %, blur, noise 5 %, three cutouts of 10 %, mosaic.
"""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.cell import Cell
from regrasp.perception.camera.model import project
from regrasp.perception.pose.detector import NETWORK_HEIGHT, NETWORK_WIDTH, STRIDE, letterboxed, pixel_sizes
from regrasp.perception.pose.segmentation import SegmentationParameters, color_mask
from regrasp.sim.cameras.depth_noise import DepthNoise
from regrasp.sim.random_scenes.scene import RandomScene, Shot

FloatArray = NDArray[np.float64]

SHOTS = 24  # of one scene; choice: a scene costs as much to make as six pictures
ABSENT = 6  # every sixth picture is without the connector, among its look-alikes
PATCH = 160  # px; choice: training on parts of pictures, mostly about the connector, learns more a second
CLEAR = 24  # px of the small picture that must show of a connector that counts: 6 cells' corners; less is left out
NEAR_CONNECTOR, NEAR_LIKE = (
    0.6,
    0.3,
)  # share of the patches that are cut about the connector, about its colour elsewhere
LIKES = 16  # places of its colour kept of a picture
BLIND = 0.05  # share of the patches without any depth
MOSAIC = 0.15  # share of the patches that are made of four


@dataclass(frozen=True, eq=False)
class Pictures:
    """So many small pictures and their truth.

    `images` (n, 240, 432, 3) uint8; `sizes` (n, 120, 216) uint16: `pixel_sizes` in micrometres; `masks` (n, 240, 432)
    uint8, 255 where the connector shows; `axes` (n, 2): where its unit axis points in the image, as long as it is seen
    (`Detection.in_plane`); `likes` (n, 16, 2): pixels (u, v) of its colour elsewhere, -1 where there is none.
    """

    images: NDArray[np.uint8]
    sizes: NDArray[np.uint16]
    masks: NDArray[np.uint8]
    axes: NDArray[np.float32]
    likes: NDArray[np.int16]

    def part(self, first: int, after: int) -> "Pictures":
        """Pictures `first` to `after` - 1, not copied."""
        some = slice(first, after)
        return Pictures(self.images[some], self.sizes[some], self.masks[some], self.axes[some], self.likes[some])


@dataclass(frozen=True)
class Target:
    """A connector in a patch: its box (u0, v0, u1, v1) px, its axis (2,) as in `Pictures`, whether it shows enough."""

    box: tuple[float, float, float, float]
    axis: tuple[float, float]
    counts: bool


def make_pictures(cell: Cell, seed: int, count: int, tell: Callable[[int], None] = lambda _done: None) -> Pictures:
    """`count` pictures of scenes drawn from `seed`; `tell` is called with the number that is done."""
    out = Pictures(
        np.zeros((count, NETWORK_HEIGHT, NETWORK_WIDTH, 3), np.uint8),
        np.zeros((count, NETWORK_HEIGHT // 2, NETWORK_WIDTH // 2), np.uint16),
        np.zeros((count, NETWORK_HEIGHT, NETWORK_WIDTH), np.uint8),
        np.zeros((count, 2), np.float32),
        np.full((count, LIKES, 2), -1, np.int16),
    )
    color = SegmentationParameters.for_color(cell.known.connector.color)
    for first in range(0, count, SHOTS):
        rng = np.random.default_rng([seed, first])
        scene = RandomScene(cell, rng)
        noise = {spec.name: DepthNoise(spec, cell.hidden.errors, seed + first) for spec in cell.known.cameras}
        for i in range(first, min(first + SHOTS, count)):
            shot = scene.shot(present=i % ABSENT != ABSENT - 1)
            out.images[i], _ = letterboxed(shot.rgb)
            depth = noise[shot.camera.name].apply(shot.depth, i)
            out.sizes[i] = np.clip(1e6 * pixel_sizes(depth, shot.camera.intrinsics), 0, 65535).round()
            out.masks[i] = letterboxed(shot.mask * np.uint8(255))[0]
            out.axes[i] = axis_in_image(shot)
            out.likes[i] = _likes(out.images[i], out.masks[i], color, rng)
            tell(i + 1)
        scene.close()
    return out


def _likes(
    image: NDArray[np.uint8], mask: NDArray[np.uint8], color: SegmentationParameters, rng: np.random.Generator
) -> NDArray[np.int16]:
    """Random pixels (16, 2) of the connector's colour that are not the connector's; -1 if there are none."""
    v, u = np.nonzero((color_mask(image, color) > 0) & (mask == 0))
    if not len(u):
        return np.full((LIKES, 2), -1, np.int16)
    return np.column_stack([u, v])[rng.integers(len(u), size=LIKES)].astype(np.int16)


def axis_in_image(shot: Shot) -> FloatArray:
    """Where the connector's unit axis points in the image (2,), as long as its part that is square to the view."""
    pose = shot.world_from_camera.inv() * shot.world_from_connector
    center, axis = pose.translation, pose.rotation.apply([1.0, 0.0, 0.0])
    ray = center / np.linalg.norm(center)
    here, there = project(np.array([center, center + 1e-4 * axis]), shot.camera.intrinsics)
    length = float(np.linalg.norm(there - here))
    square = float(np.linalg.norm(axis - (axis @ ray) * ray))
    return np.nan_to_num((there - here) / max(length, 1e-12) * square)


def draw_patch(
    pictures: Pictures, rng: np.random.Generator
) -> tuple[NDArray[np.uint8], NDArray[np.float32], list[Target]]:
    """A patch (160, 160, 3) of pictures and its `pixel_sizes` (80, 80), changed at random, and what it shows."""
    if rng.random() >= MOSAIC:
        image, sizes, targets = _cut(pictures, rng, PATCH)
        return _recolored(image, rng), sizes, targets
    half = PATCH // 2
    out, out_sizes = np.zeros((PATCH, PATCH, 3), np.uint8), np.zeros((half, half), np.float32)
    all_targets = []
    for u, v in ((0, 0), (half, 0), (0, half), (half, half)):
        there, there_too = ((slice(v // n, (v + half) // n), slice(u // n, (u + half) // n)) for n in (1, 2))
        out[there], out_sizes[there_too], targets = _cut(pictures, rng, half)
        for t in targets:
            box = (t.box[0] + u, t.box[1] + v, t.box[2] + u, t.box[3] + v)
            all_targets.append(Target(box, t.axis, t.counts))
    return _recolored(out, rng), out_sizes, all_targets


def _cut(
    pictures: Pictures, rng: np.random.Generator, size: int
) -> tuple[NDArray[np.uint8], NDArray[np.float32], list[Target]]:
    """A square of `size` px, turned, zoomed, sheared and mirrored, with parts cut out."""
    i = int(rng.integers(len(pictures.images)))
    image, mask = pictures.images[i], pictures.masks[i]
    middle, draw = rng.uniform([0, 0], [NETWORK_WIDTH, NETWORK_HEIGHT]), float(rng.random())
    like = pictures.likes[i, rng.integers(LIKES)]
    if draw < NEAR_CONNECTOR and mask.any():
        u, v, width, height = cv2.boundingRect(mask)
        middle = np.array([u + width / 2, v + height / 2])
    elif draw < NEAR_CONNECTOR + NEAR_LIKE and like[0] >= 0:
        middle = like.astype(float)
    change = _change(rng)
    matrix = np.column_stack([change, rng.uniform(0.1, 0.9, 2) * size - change @ middle])
    image = cv2.warpAffine(image, matrix, (size, size), flags=cv2.INTER_LINEAR)
    mask = cv2.warpAffine(mask, matrix, (size, size), flags=cv2.INTER_LINEAR)
    zoom = float(np.sqrt(abs(np.linalg.det(change))))
    # As `matrix`, of every second pixel; no half pixel more, as a reading is of the upper left one of its four.
    halved = np.column_stack([change, matrix[:, 2] / 2])
    sizes = cv2.warpAffine(pictures.sizes[i], halved, (size // 2, size // 2), flags=cv2.INTER_NEAREST)
    sizes = sizes * np.float32(1e-6 / zoom)
    if rng.random() < BLIND:
        sizes[:] = 0.0
    _cut_out(image, sizes, mask, rng)
    mask = np.asarray(mask >= 128, np.uint8)
    area = cv2.countNonZero(mask)
    if not area:
        return image, sizes, []
    u, v, width, height = cv2.boundingRect(mask)
    axis = change @ pictures.axes[i]
    axis *= np.linalg.norm(pictures.axes[i]) / max(float(np.linalg.norm(axis)), 1e-9)
    return image, sizes, [Target((u, v, u + width, v + height), tuple(axis.tolist()), area >= CLEAR)]


def _change(rng: np.random.Generator) -> FloatArray:
    """A matrix (2, 2) on pixels: mirror, quarter turn, turn up to 15 degrees, shear up to 15 degrees, zoom."""
    angle = np.deg2rad(rng.uniform(-15, 15)) + np.pi / 2 * rng.integers(4) * (rng.random() < 0.3)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    shear = np.eye(2)
    if rng.random() < 0.3:
        shear[0, 1], shear[1, 0] = np.tan(np.deg2rad(rng.uniform(-15, 15, 2)))
    zoom = np.exp(rng.uniform(np.log(0.75), np.log(1.4)))  # the crop of up to a fifth, and as much smaller
    return np.asarray(zoom * turn @ shear @ np.diag([rng.choice([-1.0, 1.0]), 1.0]))


def _cut_out(
    image: NDArray[np.uint8], sizes: NDArray[np.float32], mask: NDArray[np.uint8], rng: np.random.Generator
) -> None:
    """Cover up to three rectangles, a tenth of a whole picture's edges each, with plain colours, nearer or unread."""
    if rng.random() < 0.5:
        return
    for _ in range(3):
        u, v = rng.integers(0, image.shape[0], 2)
        there = slice(v, v + NETWORK_HEIGHT // 10), slice(u, u + NETWORK_WIDTH // 10)
        image[there], mask[there] = rng.integers(0, 256, 3), 0
        nearer = rng.choice([0.0, rng.uniform(0.6, 1.0)])
        sizes[v // 2 : (v + NETWORK_HEIGHT // 10) // 2, u // 2 : (u + NETWORK_WIDTH // 10) // 2] = (
            nearer * sizes[v // 2, u // 2]
        )


def _recolored(image: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    """Other hue, saturation, brightness and exposure; blur; noise."""
    if rng.random() < 0.5:
        hsv = cv2.cvtColor(image, cv2.COLOR_RGB2HSV).astype(np.float32)
        hsv[..., 0] = (hsv[..., 0] + rng.uniform(-25, 25) / 2) % 180
        hsv[..., 1] *= rng.uniform(0.75, 1.25)
        image = cv2.cvtColor(np.clip(hsv, 0, 255).astype(np.uint8), cv2.COLOR_HSV2RGB)
    if rng.random() < 0.5:
        gamma, gain = np.exp(rng.uniform(-0.4, 0.4)), rng.uniform(0.75, 1.25)
        table = np.clip(255 * gain * (np.arange(256) / 255) ** gamma, 0, 255).astype(np.uint8)
        image = np.asarray(cv2.LUT(image, table), np.uint8)
    if rng.random() < 0.3:
        image = np.asarray(cv2.GaussianBlur(image, (0, 0), rng.uniform(0.3, 1.25)), np.uint8)  # 2.5 px of the camera's
    if rng.random() < 0.3:
        noisy = image + rng.normal(0, rng.uniform(0, 0.05) * 255, image.shape).astype(np.float32)
        image = np.clip(noisy, 0, 255).astype(np.uint8)
    return image


def target_maps(targets: list[Target], size: int = PATCH) -> NDArray[np.float32]:
    """What the network shall answer for a patch: (9, n, n) for n cells an edge.

    The seven maps of `regrasp.perception.pose.detector.decode`; then the weight of the last six, and that of the first:
    0 around a connector that shows too little to count.
    """
    n = size // STRIDE
    maps = np.zeros((9, n, n), np.float32)
    maps[8] = 1.0
    cells = np.arange(n) + 0.5
    for target in targets:
        u0, v0, u1, v1 = np.array(target.box) / STRIDE
        middle, edges = ((u0 + u1) / 2, (v0 + v1) / 2), (u1 - u0, v1 - v0)
        # spread with the box, at least so that the nearest cells have a share
        along, down = (max(0.6, edge / 8) for edge in edges)
        du, dv = middle[0] - cells[None], middle[1] - cells[:, None]
        blob = np.exp(-0.5 * ((du / along) ** 2 + (dv / down) ** 2))
        if not target.counts:
            maps[8][blob > 0.05] = 0.0
            continue
        blob[int(min(middle[1], n - 0.5)), int(min(middle[0], n - 0.5))] = 1.0
        here = (blob > 0.4) & (blob > maps[7])
        angle, length = np.arctan2(target.axis[1], target.axis[0]), float(np.hypot(*target.axis)) ** 2
        maps[1], maps[2] = np.where(here, du, maps[1]), np.where(here, dv, maps[2])
        values = (*np.log(edges), length * np.cos(2 * angle), length * np.sin(2 * angle))
        for k, value in enumerate(values, start=3):
            maps[k][here] = value
        maps[7] = np.where(here, blob, maps[7])
        maps[0] = np.maximum(maps[0], blob)
    return maps
