"""Parts of random scenes, in which detectors are trained and tested: colours, light, bodies without physics."""

import colorsys
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import pybullet as p
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.fields import Color
from regrasp.sim.bodies import OUT_OF_SIGHT
from regrasp.sim.render.picture import BACKGROUND, Image, LightState

_HIDDEN_POSITION = OUT_OF_SIGHT.translation.tolist()
_ALONG_X = (0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5))  # PyBullet's cylinders and capsules lie along z
Triple = tuple[float, float, float]


@dataclass(frozen=True)
class LightRange:
    """Range of random light: mean direction to it, and ranges of its strengths."""

    direction: Triple
    ambient: tuple[float, float]
    diffuse: tuple[float, float]

    def draw(self, rng: np.random.Generator) -> LightState:
        """A random light."""
        direction = np.asarray(self.direction) + rng.normal(size=3) * [1.0, 1.0, 0.5]
        return LightState(direction, float(rng.uniform(*self.ambient)), float(rng.uniform(*self.diffuse)))


def random_color(rng: np.random.Generator, value: tuple[float, float] = (0.1, 0.95)) -> Color:
    """RGB of a random hue, often greyish, with a brightness (HSV value) in the range `value`."""
    saturation = float(rng.beta(1.0, 1.5))
    return colorsys.hsv_to_rgb(float(rng.random()), saturation, float(rng.uniform(*value)))


def similar_color(color: Color, rng: np.random.Generator) -> Color:
    """RGB near `color`: hue within 10 degrees, saturation down to three quarters, brightness within a quarter."""
    hue, saturation, value = colorsys.rgb_to_hsv(*color)
    saturation, value = saturation * float(rng.uniform(0.75, 1.0)), min(1.0, value * float(rng.uniform(0.75, 1.25)))
    return colorsys.hsv_to_rgb((hue + float(rng.uniform(-10, 10)) / 360) % 1.0, saturation, value)


def contrasting_color(color: Color, rng: np.random.Generator) -> Color:
    """RGB with a hue at least 60 degrees away from that of `color`."""
    hue = colorsys.rgb_to_hsv(*color)[0] + float(rng.uniform(60, 300)) / 360
    return colorsys.hsv_to_rgb(hue % 1.0, float(rng.uniform(0.5, 1.0)), float(rng.uniform(0.3, 0.9)))


def visual_body(client: int, kind: int, color: Color, **size: object) -> int:
    """Id of a new body without a collision shape, out of sight; cylinders and capsules lie along its x axis."""
    turned = {} if kind in (p.GEOM_BOX, p.GEOM_SPHERE) else {"visualFrameOrientation": _ALONG_X}
    visual = p.createVisualShape(kind, rgbaColor=[*color, 1], **size, **turned, physicsClientId=client)
    return int(p.createMultiBody(0, -1, visual, _HIDDEN_POSITION, physicsClientId=client))


def set_pose(client: int, body: int, pose: RigidTransform) -> None:
    """Set a body's pose to `pose`, world_from_body."""
    turn = pose.rotation.as_quat().tolist()
    p.resetBasePositionAndOrientation(body, pose.translation.tolist(), turn, physicsClientId=client)


def painted(image: Image, walls: Sequence[int], rng: np.random.Generator) -> NDArray[np.uint8]:
    """The picture (H, W, 3) in light of a random colour, with textures on some `walls` (ids) and on the background."""
    rgb = cv2.multiply(image.rgb, (*rng.uniform(0.85, 1.0, 3), 1.0))
    for body in (-1, *walls):
        if rng.random() < 0.4:
            there = image.ids == body
            paint = np.array(random_color(rng)) / np.array(BACKGROUND) if body == -1 else np.ones(3)
            shade = _texture(image.ids.shape, rng)[there, None] * paint
            rgb[there] = np.clip(rgb[there] * shade, 0, 255)
    return np.asarray(rgb, np.uint8)


def _texture(shape: tuple[int, int], rng: np.random.Generator) -> NDArray[np.float32]:
    """Smooth random brightness (H, W) about 1: blots of a random size and aspect, up to stripes."""
    size = rng.integers([3, 3], [40, 60])
    blots = rng.uniform(-1, 1, size).astype(np.float32) * np.float32(rng.uniform(0.05, 0.4))
    return 1.0 + cv2.resize(blots, shape[::-1], interpolation=cv2.INTER_CUBIC)
