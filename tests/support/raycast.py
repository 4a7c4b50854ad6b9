"""A tiny analytic ray caster: RGB and depth of cylinders, balls and boxes, with a stereo camera's noise."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cable.cell import Connector
from regrasp.interfaces.cell import FixedMount
from regrasp.interfaces.frame import Intrinsics, RgbdFrame

Image = NDArray[np.float64]
RED, BLACK, PURPLE, WOOD = (0.75, 0.05, 0.06), (0.06, 0.06, 0.06), (0.45, 0.2, 0.6), (0.80, 0.66, 0.45)
CONNECTOR = Connector(length=0.09, radius=0.010, color=RED)
REAR_POSE = FixedMount(position=(-0.3556, 0.0, 0.4064), pitch_down_deg=14.0).world_from_camera
MIDDLE_THIRD = Intrinsics(280, 240, 665.6, 665.6, 139.5, 119.5)  # of the rear camera: as sharp, faster to render


@dataclass(frozen=True, eq=False)
class Cylinder:
    center: NDArray[np.float64]
    axis: NDArray[np.float64]
    length: float = 0.09
    radius: float = 0.01
    color: tuple[float, float, float] = RED

    def hit(self, o: Image, d: Image) -> tuple[Image, Image]:
        a = self.axis / np.linalg.norm(self.axis)
        m = o - self.center
        d_along, m_along = d @ a, float(m @ a)
        dp, mp = d - d_along[:, None] * a, m - m_along * a
        aa, bb, cc = (dp * dp).sum(1), dp @ mp, float(mp @ mp) - self.radius**2
        root = np.sqrt(np.maximum(bb * bb - aa * cc, 0.0))
        t = np.where(bb * bb > aa * cc, (-bb - root) / np.maximum(aa, 1e-12), np.inf)
        with np.errstate(invalid="ignore"):
            side = np.where((t > 0) & (np.abs(m_along + t * d_along) <= self.length / 2), t, np.inf)
        normal = np.nan_to_num(mp + np.where(np.isfinite(side), side, 0.0)[:, None] * dp) / self.radius
        best = side
        for sign in (1.0, -1.0):
            with np.errstate(divide="ignore", invalid="ignore"):
                cap = (sign * self.length / 2 - m_along) / d_along
            cap = np.where(np.isfinite(cap) & (cap > 0), cap, 0.0)
            inside = (cap > 0) & (((mp + cap[:, None] * dp) ** 2).sum(1) <= self.radius**2) & (cap < best)
            best = np.where(inside, cap, best)
            normal[inside] = sign * a
        return best, normal


@dataclass(frozen=True, eq=False)
class Ball:
    center: NDArray[np.float64]
    radius: float
    color: tuple[float, float, float] = RED

    def hit(self, o: Image, d: Image) -> tuple[Image, Image]:
        m = o - self.center
        a, b, c = (d * d).sum(1), d @ m, float(m @ m) - self.radius**2
        root = np.sqrt(np.maximum(b * b - a * c, 0.0))
        t = np.where((b * b > a * c) & (b < -root), (-b - root) / a, np.inf)
        return t, (m + np.where(np.isfinite(t), t, 0.0)[:, None] * d) / self.radius


@dataclass(frozen=True, eq=False)
class Block:
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    color: tuple[float, float, float] = PURPLE

    def hit(self, o: Image, d: Image) -> tuple[Image, Image]:
        safe = np.where(np.abs(d) < 1e-12, 1e-12, d)
        t0, t1 = (self.lower - o) / safe, (self.upper - o) / safe
        near, far = np.minimum(t0, t1), np.maximum(t0, t1)
        enter = near.max(1)
        axis = near.argmax(1)
        t = np.where((enter > 0) & (enter <= far.min(1)), enter, np.inf)
        normal = np.zeros_like(d)
        normal[np.arange(len(d)), axis] = -np.sign(d[np.arange(len(d)), axis])
        return t, normal


@dataclass(frozen=True, eq=False)
class Sensor:
    """Depth errors of a stereo camera; the defaults are the thesis cell's rear D415 as `errors` has it."""

    subpixel: float = 0.2
    fb: float = 665.6 * 0.055
    scale: float = 0.0
    correlation: float = 1.5  # pixels
    gray_noise: float = 1.0
    shadow: bool = True
    flying: bool = True
    light: float = 1.0
    to_light: tuple[float, float, float] = field(default=(-0.4, 0.25, 0.85))


IDEAL = Sensor(subpixel=0.0, gray_noise=0.0, shadow=False, flying=False)


def render(
    things: Sequence[Cylinder | Block | Ball],
    world_from_camera: RigidTransform,
    k: Intrinsics,
    sensor: Sensor,
    seed: int,
) -> RgbdFrame:
    rng = np.random.default_rng(seed)
    u, v = np.meshgrid(np.arange(k.width), np.arange(k.height))
    optical = np.stack([(u - k.cx) / k.fx, (v - k.cy) / k.fy, np.ones(u.shape)], -1).reshape(-1, 3)
    d = world_from_camera.rotation.apply(optical)
    o = np.asarray(world_from_camera.translation)
    depth = np.full(len(d), np.inf)
    color = np.full((len(d), 3), 0.5)
    light = np.asarray(sensor.to_light) / np.linalg.norm(sensor.to_light)
    for thing in things:
        t, normal = thing.hit(o, d)
        nearer = t < depth
        depth[nearer] = t[nearer]
        shade = sensor.light * (0.45 + 0.55 * np.clip(normal[nearer] @ light, 0, 1))
        color[nearer] = np.asarray(thing.color) * shade[:, None]
    shape = (k.height, k.width)
    rgb = 255 * color.reshape(*shape, 3) + rng.normal(0, sensor.gray_noise, (*shape, 3))
    clean = depth.reshape(shape)
    return RgbdFrame("rear", seed, 0.0, np.clip(np.rint(rgb), 0, 255).astype(np.uint8), _sense(clean, sensor, rng), k)


def _sense(clean: Image, sensor: Sensor, rng: np.random.Generator) -> NDArray[np.float32]:
    z = np.where(np.isfinite(clean), clean, 0.0)
    if sensor.flying:  # an edge pixel sometimes reads a mixture with its neighbour
        neighbour = np.roll(z, rng.choice([-1, 1]), axis=int(rng.integers(2)))
        mixed = (np.abs(neighbour - z) > 0.01) & (rng.random(z.shape) < 0.5) & (neighbour > 0)
        z = np.where(mixed, z + rng.random(z.shape) * (neighbour - z), z)
    noise = cv2.GaussianBlur(rng.normal(size=z.shape), (0, 0), sensor.correlation) if sensor.correlation else 0.0
    noise = noise * (2 * np.sqrt(np.pi) * sensor.correlation)  # back to unit variance
    out = z * (1 + sensor.scale) + noise * z**2 * sensor.subpixel / sensor.fb
    if sensor.shadow:
        out[_shadow(clean, sensor.fb)] = 0.0
    out[z == 0] = 0.0
    return np.asarray(np.rint(out * 1000) / 1000, np.float32)


def _shadow(clean: Image, fb: float) -> NDArray[np.bool_]:
    """Pixels that the right imager cannot see: a nearer surface's disparity covers them from the right."""
    disparity = np.where(np.isfinite(clean), fb / np.maximum(clean, 1e-6), 0.0)
    lands = np.arange(clean.shape[1]) - disparity
    covered = np.minimum.accumulate(lands[:, ::-1], axis=1)[:, ::-1]
    return np.asarray(lands > covered + 1.0)
