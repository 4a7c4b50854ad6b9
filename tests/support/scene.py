"""The thesis's cell for the ray caster: floor and panels, a connector with its cable, a camera with a pose error."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from raycast import BLACK, REAR_POSE, RED, Ball, Block, Cylinder, Sensor, render
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cell import Box
from regrasp.interfaces.frame import Intrinsics, RgbdFrame
from regrasp.perception.camera.model import project, subsampled
from regrasp.perception.camera.registration import CameraErrors, RegistrationParameters

Vector = NDArray[np.float64]
Color = tuple[float, float, float]
Thing = Cylinder | Block | Ball
REAR = Intrinsics.from_fov(848, 480, float(np.deg2rad(65.0)))
PLACE = np.array([0.36, 0.02, 0.33])  # m, where the work is
LEFTWARDS = np.array([0.1, 1.0, 0.2]) / np.sqrt(1.05)
COARSE_STEP = RegistrationParameters().pixel_step
WINDOW = 110  # pixels to each side: the connector at 0.65 m, and what is looked at around it


def blocks(boxes: Sequence[Box]) -> list[Thing]:
    """Boxes as the ray caster knows them."""
    return [
        Block(np.subtract(b.center, np.divide(b.size, 2)), np.add(b.center, np.divide(b.size, 2)), b.color)
        for b in boxes
    ]


def plug(center: Vector = PLACE, axis: Vector = LEFTWARDS, color: Color = RED, cable: Color = BLACK) -> list[Thing]:
    """A connector and the 0.1 m of cable behind it."""
    return [Cylinder(center, axis, color=color), Cylinder(center - 0.095 * axis, axis, 0.1, 0.0035, cable)]


def really(told: RigidTransform, errors: CameraErrors, rng: np.random.Generator) -> RigidTransform:
    """A camera's pose, drawn around the one that is told."""
    moved = told.translation + rng.normal(0.0, errors.position, 3)
    turned = Rotation.from_rotvec(rng.normal(0.0, errors.rotation, 3)) * told.rotation
    return RigidTransform.from_components(moved, turned)


def seen(
    things: list[Thing],
    at: Vector = PLACE,
    sensor: Sensor | None = None,
    seed: int = 5,
    camera: RigidTransform = REAR_POSE,
) -> RgbdFrame:
    """The rear camera's frame: whole within `WINDOW` pixels of `at` (3,) m, elsewhere what `register` reads."""
    sensor = sensor or Sensor()
    u, v = np.rint(project(camera.inv().apply(at)[None], REAR)[0]).astype(int)
    u0, u1 = (int(np.clip(u + side, 0, REAR.width)) for side in (-WINDOW, WINDOW))
    v0, v1 = (int(np.clip(v + side, 0, REAR.height)) for side in (-WINDOW, WINDOW))
    alone = replace(sensor, correlation=0.3, shadow=False, flying=False)  # 16 pixels apart
    coarse = render(things, camera, subsampled(REAR, COARSE_STEP), alone, seed)
    window = Intrinsics(u1 - u0, v1 - v0, REAR.fx, REAR.fy, REAR.cx - u0, REAR.cy - v0)
    fine = render(things, camera, window, sensor, seed)
    rgb = np.full((REAR.height, REAR.width, 3), 128, np.uint8)
    depth = np.zeros((REAR.height, REAR.width), np.float32)
    depth[::COARSE_STEP, ::COARSE_STEP] = coarse.depth
    rgb[v0:v1, u0:u1], depth[v0:v1, u0:u1] = fine.rgb, fine.depth
    return RgbdFrame("rear", seed, 0.0, rgb, depth, REAR)


def without_boxes(known: CableKnown) -> CableKnown:
    """The cell of which no panel is known: cameras are taken at their word."""
    return known.model_copy(update={"boxes": ()})
