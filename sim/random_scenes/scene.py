"""Random pictures of the connector with its true mask: what a detector is trained and tested on. No physics runs."""

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
import pybullet as p
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cell import OPTICAL, CameraSpec, Cell, WristMount
from regrasp.sim.build import build_boxes
from regrasp.sim.random_scenes.things import (
    AWAY,
    UNDER_FLOOR,
    any_color,
    like,
    make_plug,
    make_things,
    put,
    rearranged,
    repainted,
    shape,
    unlike,
)
from regrasp.sim.render.picture import BACKGROUND, Image, LightState
from regrasp.sim.render.renderer import RendererName, make_renderer
from regrasp.sim.render.visuals import Visuals
from regrasp.sim.robot.arm import SimArm
from regrasp.sim.robot.model import finger_position

FloatArray = NDArray[np.float64]

LOW, HIGH = np.array([0.10, -0.40, 0.04]), np.array([0.48, 0.42, 0.62])  # m: where the connector may be
PLUGGED, STOWED, HELD = (
    0.15,
    0.25,
    0.45,
)  # of the draws: in a socket, in the clip, in the right hand; else it hangs free
HIDING = 0.6  # share of the pictures in which a piece of foam is put before the connector
THINGS, OCCLUDERS = 8, 3  # in a scene; a picture shows some of them
# Mean direction to the light, then the ranges of its ambient and diffuse strength.
LIGHT = ((-0.5, 0.3, 1.0), (0.2, 0.7), (0.15, 0.7))
HELD_OUT_LIGHT = ((-0.2, -1.2, 0.6), (0.3, 0.8), (0.05, 0.5))
ARM_SPREAD = np.array([0.6, 0.5, 0.5, 0.8, 0.6, 1.5])  # rad: the joints' standard deviations about stretching forward


@dataclass(frozen=True, eq=False)
class Shot:
    """A picture and its truth.

    `rgb` (H, W, 3) uint8, `depth` (H, W) float32 m without noise; `mask` (H, W): the connector's visible pixels, none
    if it is not there; `occlusion`: the share of its pixels that something hides, NaN if not measured or none is seen.
    """

    rgb: NDArray[np.uint8]
    depth: NDArray[np.float32]
    mask: NDArray[np.bool_]
    occlusion: float
    camera: CameraSpec
    world_from_camera: RigidTransform
    world_from_connector: RigidTransform


class RandomScene:
    """A cell with arms, cables, look-alikes and clutter of random shapes and colours, posed anew for each `shot`.

    `held_out`: another layout of panels and sockets, other light, and other kinds of things.
    """

    def __init__(
        self, cell: Cell, rng: np.random.Generator, held_out: bool = False, renderer: RendererName = "auto"
    ) -> None:
        self._client: int = p.connect(p.DIRECT)
        self._cell, self._rng = cell, rng
        self._light = HELD_OUT_LIGHT if held_out else LIGHT
        self._known = repainted(rearranged(cell.known, rng) if held_out else cell.known, rng)
        bodies = build_boxes(self._client, self._known, ())
        self._walls = [bodies[box.name] for box in cell.known.boxes]
        self._arms = {spec.name: self._make_arm(spec.name) for spec in cell.known.arms}
        connector, radius = cell.known.connector, cell.hidden.cable.radius
        dark = any_color(rng, (0.02, 0.25))
        self._plug = make_plug(self._client, connector, like(connector.color, rng), radius, dark)
        self._other = make_plug(self._client, connector, unlike(connector.color, rng), radius, any_color(rng))
        self._things = make_things(self._client, connector, rng, THINGS, held_out)
        halves = rng.uniform([0.01, 0.01, 0.04], [0.06, 0.06, 0.2], (OCCLUDERS, 3))
        colors = [any_color(rng) for _ in halves]
        self._pieces = [
            (shape(self._client, p.GEOM_BOX, color, halfExtents=half.tolist()), half)
            for color, half in zip(colors, halves, strict=True)
        ]
        self._visuals = Visuals(self._client)
        self._renderer = make_renderer(self._visuals, renderer)

    def close(self) -> None:
        """Free the client and the renderer."""
        self._renderer.close()
        p.disconnect(self._client)

    def shot(self, present: bool = True, measured: bool = False) -> Shot:
        """A new picture; without the connector if it is not `present`, its look-alikes near where it would be.

        `measured`: with the occlusion, for which the connector is drawn a second time, alone.
        """
        pose = self._pose_connector()
        spec, camera = self._pose_camera(pose.translation)
        k = spec.intrinsics
        self._lay_cables(pose, present)
        self._strew(pose, camera, present)
        poses, light = self._visuals.snapshot(), self._draw_light()
        image = self._renderer.render(poses, camera, k, light)
        mask, occlusion = image.ids == self._plug.end, float("nan")
        if measured and mask.any():
            alone = poses.copy()
            alone[self._visuals.ids != self._plug.end, :, 3] = UNDER_FLOOR
            whole = self._renderer.render(alone, camera, k, light).ids == self._plug.end
            occlusion = 1.0 - np.count_nonzero(mask) / np.count_nonzero(whole)
        return Shot(self._dress(image), image.depth, mask, occlusion, spec, camera, pose)

    def _make_arm(self, name: Literal["left", "right"]) -> SimArm:
        cell = self._cell
        mounts = {c.mount.arm: c.mount.offset for c in cell.known.cameras if isinstance(c.mount, WristMount)}
        spec, hidden = cell.known.arm(name), cell.hidden
        return SimArm(
            self._client, spec, hidden.gripper, hidden.errors, 1 / hidden.step_rate, mounts.get(name), self._rng
        )

    def _pose_connector(self) -> RigidTransform:
        """Pose the arms, and draw where the connector is."""
        rng, length = self._rng, self._known.connector.length
        for arm in self._arms.values():
            self._pose_arm(arm)
        draw = float(rng.random())
        if draw < PLUGGED:
            return self._known.sockets[int(rng.integers(len(self._known.sockets)))].world_from_plug(length)
        if draw < STOWED:
            return self._known.clip.world_from_seat
        if draw < HELD:
            return self._in_hand()
        return RigidTransform.from_components(rng.uniform(LOW, HIGH), Rotation.random(rng=rng))

    def _pose_arm(self, arm: SimArm) -> None:
        rng, sleep = self._rng, self._cell.known.arm(arm.name).sleep
        arm.place(np.array(sleep) if rng.random() < 0.3 else rng.normal(0.0, ARM_SPREAD))
        opening = finger_position(float(rng.uniform(0.018, 0.08)), self._cell.hidden.gripper.pad_thickness)
        for finger, side in (("left_finger_link", 1), ("right_finger_link", -1)):
            p.resetJointState(arm.body, arm.links[finger], side * opening, physicsClientId=self._client)

    def _in_hand(self) -> RigidTransform:
        """The connector between the pads of the right hand, which is brought into the connector's space."""
        rng, arm = self._rng, self._arms["right"]
        tool = arm.tool_pose()
        for _ in range(30):  # choice: three draws of four end outside
            self._pose_arm(arm)
            tool = arm.tool_pose()
            if np.all((tool.translation > LOW) & (tool.translation < HIGH)):
                break
        slant = Rotation.from_euler("y", float(rng.choice([-90, 90]) + rng.normal(0, 10)), degrees=True)
        slide = [float(rng.uniform(-0.035, 0.035)), 0.0, 0.0]
        return tool * RigidTransform.from_rotation(slant) * RigidTransform.from_translation(slide)

    def _pose_camera(self, target: FloatArray) -> tuple[CameraSpec, RigidTransform]:
        """A camera and world_from_camera: the rear camera a little off its place, or one anywhere on the arms' side."""
        rng, known = self._rng, self._cell.known
        spec = known.cameras[int(rng.integers(len(known.cameras)))]
        if not isinstance(spec.mount, WristMount) and rng.random() < 0.8:
            turn = Rotation.from_rotvec(rng.normal(0.0, 0.05, 3))
            pose = spec.mount.world_from_camera
            return spec, RigidTransform.from_components(pose.translation + rng.normal(0, 0.05, 3), pose.rotation * turn)
        distance = float(rng.uniform(0.2, 0.5 if isinstance(spec.mount, WristMount) else 1.2))
        yaw, down, roll = rng.uniform([-70, -20, -30], [70, 60, 30])
        turn = Rotation.from_euler("ZYX", [yaw, down, roll], degrees=True)
        aside = rng.uniform(-0.35, 0.35, 3) * distance * [0, 1, 0.6]  # the target's place in the image
        pose = RigidTransform.from_components(target, turn) * RigidTransform.from_translation([-distance, *aside[1:]])
        return spec, pose * RigidTransform.from_rotation(OPTICAL)

    def _lay_cables(self, pose: RigidTransform, present: bool) -> None:
        rng = self._rng
        anchor, away = self._known.cable_anchor
        self._plug.hide()
        if present:
            self._plug.lay(pose, anchor, away)
        self._other.hide()
        if rng.random() < 0.5:
            turn = Rotation.random(rng=rng)
            self._other.lay(RigidTransform.from_components(rng.uniform(LOW, HIGH), turn), rng.uniform(LOW, HIGH), away)

    def _strew(self, pose: RigidTransform, camera: RigidTransform, present: bool) -> None:
        """Put some things into the space, half of those near the connector's place, and foam before the connector."""
        rng = self._rng
        for thing in self._things:
            center = pose.translation + rng.normal(0, 0.1, 3) if rng.random() < 0.5 else rng.uniform(LOW, HIGH)
            seen = rng.random() < 0.4
            thing.put(self._client, RigidTransform.from_components(center, Rotation.random(rng=rng)) if seen else AWAY)
        for body, _ in self._pieces:
            upright = Rotation.from_euler("z", float(rng.uniform(0, 180)), degrees=True)
            center = rng.uniform([0.1, -0.4, 0.0], [0.45, 0.4, 0.3])
            put(self._client, body, RigidTransform.from_components(center, upright) if rng.random() < 0.3 else AWAY)
        if rng.random() < HIDING:
            body, half = self._pieces[int(rng.integers(len(self._pieces)))]
            put(self._client, body, self._before(pose, camera, half))

    def _before(self, pose: RigidTransform, camera: RigidTransform, half: FloatArray) -> RigidTransform:
        """A pose for a box of half edges `half` (3,), m, at which it hides a part of the connector from the camera."""
        rng = self._rng
        axis = pose.rotation.apply([1.0, 0.0, 0.0])
        ray = pose.translation - camera.translation
        ray /= np.linalg.norm(ray)
        side = axis - (axis @ ray) * ray  # in the image, along the connector
        side *= float(rng.choice([-1, 1])) / max(float(np.linalg.norm(side)), 1e-6)
        edge = pose.translation + float(rng.uniform(-0.4, 0.45)) * self._known.connector.length * side
        turn = Rotation.from_euler("z", float(rng.uniform(0, 180)), degrees=True)
        if rng.random() < 0.5:  # square to the connector in the image, as its edge
            turn = Rotation.from_matrix(np.column_stack([-side, np.cross(ray, -side), ray]))
        reach = float(np.abs(turn.inv().apply(side)) @ half)
        depth = float(np.abs(turn.inv().apply(ray)) @ half)
        return RigidTransform.from_components(edge + reach * side - (depth + rng.uniform(0.012, 0.1)) * ray, turn)

    def _draw_light(self) -> LightState:
        rng, (mean, ambient, diffuse) = self._rng, self._light
        direction = np.asarray(mean) + rng.normal(size=3) * [1.0, 1.0, 0.5]
        return LightState(direction, float(rng.uniform(*ambient)), float(rng.uniform(*diffuse)))

    def _dress(self, image: Image) -> NDArray[np.uint8]:
        """The picture with a texture on the walls or behind the scene, in light of some colour."""
        rng = self._rng
        rgb = cv2.multiply(image.rgb, (*rng.uniform(0.85, 1.0, 3), 1.0))
        for body in (-1, *self._walls):
            if rng.random() < 0.4:
                there = image.ids == body
                paint = np.array(any_color(rng)) / np.array(BACKGROUND) if body == -1 else np.ones(3)
                shade = _texture(image.ids.shape, rng)[there, None] * paint
                rgb[there] = np.clip(rgb[there] * shade, 0, 255)
        return np.asarray(rgb, np.uint8)


def _texture(shape: tuple[int, int], rng: np.random.Generator) -> NDArray[np.float32]:
    """Smooth random brightness (H, W) about 1: blots of a random size, stretched to stripes now and then."""
    size = rng.integers([3, 3], [40, 60])
    blots = rng.uniform(-1, 1, size).astype(np.float32) * np.float32(rng.uniform(0.05, 0.4))
    return 1.0 + cv2.resize(blots, shape[::-1], interpolation=cv2.INTER_CUBIC)
