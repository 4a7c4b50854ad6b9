"""Training pictures of the detector: random pictures of a cell at the network's resolution, with their ground truth."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from regrasp.interfaces.cable.cell import CableCell
from regrasp.perception.camera.color import SegmentationParameters, color_mask
from regrasp.perception.camera.model import project
from regrasp.perception.detection import letterboxed
from regrasp.perception.pose.detector import NETWORK_HEIGHT, NETWORK_WIDTH, pixel_sizes
from regrasp.sim.cable.random_scenes.scene import RandomScene, Shot
from regrasp.sim.cameras.depth_noise import DepthNoise


@dataclass(frozen=True)
class PictureParameters:
    """How the random pictures are drawn."""

    shots_per_scene: int = 24  # choice: to make a scene costs as much as to draw six pictures
    absent_every: int = 6  # one picture of so many shows look-alikes, but no connector; choice
    look_alike_pixels: int = 16  # pixels kept per picture that have the connector's colour, but are not the connector


@dataclass(frozen=True, eq=False)
class Pictures:
    """n small pictures, as the network sees them, and their ground truth.

    `images` (n, 240, 432, 3) uint8, RGB. `sizes` (n, 120, 216) uint16: `pixel_sizes` in micrometres. `masks`
    (n, 240, 432) uint8: 255 where the connector is visible. `axes` (n, 2): the direction of the connector's unit axis
    in the image; its length is the foreshortening (`Detection.in_plane`). `look_alikes` (n, 16, 2): pixels (u, v) of
    the connector's colour that are not the connector, -1 where there are none.
    """

    images: NDArray[np.uint8]
    sizes: NDArray[np.uint16]
    masks: NDArray[np.uint8]
    axes: NDArray[np.float32]
    look_alikes: NDArray[np.int16]

    def part(self, first: int, after: int) -> "Pictures":
        """Pictures `first` to `after` - 1, not copied."""
        chosen = slice(first, after)
        return Pictures(
            self.images[chosen], self.sizes[chosen], self.masks[chosen], self.axes[chosen], self.look_alikes[chosen]
        )


def make_pictures(
    cell: CableCell,
    seed: int,
    count: int,
    report_progress: Callable[[int], None] = lambda _done: None,
    parameters: PictureParameters = PictureParameters(),
) -> Pictures:
    """`count` pictures of scenes drawn from `seed`; `report_progress` is called with the number drawn so far."""
    out = Pictures(
        np.zeros((count, NETWORK_HEIGHT, NETWORK_WIDTH, 3), np.uint8),
        np.zeros((count, NETWORK_HEIGHT // 2, NETWORK_WIDTH // 2), np.uint16),
        np.zeros((count, NETWORK_HEIGHT, NETWORK_WIDTH), np.uint8),
        np.zeros((count, 2), np.float32),
        np.full((count, parameters.look_alike_pixels, 2), -1, np.int16),
    )
    color = SegmentationParameters.for_color(cell.known.cable.connector.color)
    for first in range(0, count, parameters.shots_per_scene):
        rng = np.random.default_rng([seed, first])
        scene = RandomScene(cell, rng)
        noise = {spec.name: DepthNoise(spec, cell.hidden.errors, seed + first) for spec in cell.known.cameras}
        for i in range(first, min(first + parameters.shots_per_scene, count)):
            shot = scene.shot(present=(i + 1) % parameters.absent_every != 0)
            out.images[i], _ = letterboxed(shot.rgb, (NETWORK_HEIGHT, NETWORK_WIDTH))
            depth = noise[shot.camera.name].apply(shot.depth, i)
            out.sizes[i] = np.clip(1e6 * pixel_sizes(depth, shot.camera.intrinsics), 0, 65535).round()
            out.masks[i] = letterboxed(shot.mask * np.uint8(255), (NETWORK_HEIGHT, NETWORK_WIDTH))[0]
            out.axes[i] = axis_in_image(shot)
            out.look_alikes[i] = _look_alike_pixels(
                out.images[i], out.masks[i], color, parameters.look_alike_pixels, rng
            )
            report_progress(i + 1)
        scene.close()
    return out


def _look_alike_pixels(
    image: NDArray[np.uint8],
    mask: NDArray[np.uint8],
    color: SegmentationParameters,
    count: int,
    rng: np.random.Generator,
) -> NDArray[np.int16]:
    """Random pixels (count, 2) of the connector's colour that are not the connector; -1 if there are none."""
    v, u = np.nonzero((color_mask(image, color) > 0) & (mask == 0))
    if not len(u):
        return np.full((count, 2), -1, np.int16)
    return np.column_stack([u, v])[rng.integers(len(u), size=count)].astype(np.int16)


def axis_in_image(shot: Shot) -> NDArray[np.float64]:
    """The direction (2,) of the connector's axis in the image, as long as the sine of its angle to the viewing ray."""
    pose = shot.world_from_camera.inv() * shot.world_from_connector
    center, axis = pose.translation, pose.rotation.apply([1.0, 0.0, 0.0])
    ray = center / np.linalg.norm(center)
    here, there = project(np.array([center, center + 1e-4 * axis]), shot.camera.intrinsics)
    length = float(np.linalg.norm(there - here))
    foreshortening = float(np.linalg.norm(axis - (axis @ ray) * ray))
    return np.nan_to_num((there - here) / max(length, 1e-12) * foreshortening)
