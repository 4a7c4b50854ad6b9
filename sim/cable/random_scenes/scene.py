"""Random pictures of the connector with its true mask, to train and test a detector. No physics runs."""

from dataclasses import dataclass, field

import numpy as np
import pybullet as p
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray, Mask
from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.cell import OPTICAL, CameraSpec, WristMount
from regrasp.sim.bodies import OUT_OF_SIGHT, build_box
from regrasp.sim.cable.fixtures import build_fixtures
from regrasp.sim.cable.random_scenes.clutter import make_cable, make_clutter, rearranged, repainted
from regrasp.sim.random_scenes import (
    LightRange,
    Triple,
    contrasting_color,
    painted,
    random_color,
    set_pose,
    similar_color,
    visual_body,
)
from regrasp.sim.render.renderer import RendererName, make_renderer
from regrasp.sim.render.visuals import Visuals
from regrasp.sim.robot.arm import SimArm


@dataclass(frozen=True)
class RandomSceneParameters:
    """Distribution of random scenes. All values are choices."""

    low: Triple = (0.10, -0.40, 0.04)  # m; corners of the box ...
    high: Triple = (0.48, 0.42, 0.62)  # ... in which the centre of a free or held connector lies
    plugged_share: float = 0.15  # of the pictures show the connector in a socket,
    stowed_share: float = 0.1  # in the clip,
    held_share: float = 0.2  # in the hand; in the others it hangs free
    occluded_share: float = 0.6  # of the pictures have a piece of foam in front of the connector
    clutter: int = 8  # objects in a scene; a picture shows some of them
    occluders: int = 3  # pieces of foam in a scene; a picture shows some of them
    sleeping_share: float = 0.3  # of the arms are at their sleep position
    # rad, standard deviations of the other arms' joints about the arm stretched forward
    arm_deviation: tuple[float, ...] = (0.6, 0.5, 0.5, 0.8, 0.6, 1.5)
    light: LightRange = field(default_factory=lambda: LightRange((-0.5, 0.3, 1.0), (0.2, 0.7), (0.15, 0.7)))
    held_out_light: LightRange = field(default_factory=lambda: LightRange((-0.2, -1.2, 0.6), (0.3, 0.8), (0.05, 0.5)))


@dataclass(frozen=True, eq=False)
class Shot:
    """A picture and its ground truth.

    Attributes:
        rgb: (H, W, 3) uint8.
        depth: (H, W) float32 m, without noise.
        mask: (H, W), the connector's visible pixels; none if it is absent.
        occlusion: Share of the connector's pixels that something occludes; NaN if not measured or none is visible.
        camera: The camera.
        world_from_camera: Its pose (optical frame).
        world_from_connector: The connector's pose; where it would be, if it is absent.
    """

    rgb: NDArray[np.uint8]
    depth: NDArray[np.float32]
    mask: Mask
    occlusion: float
    camera: CameraSpec
    world_from_camera: RigidTransform
    world_from_connector: RigidTransform


class RandomScene:
    """A cell with arms, cables, look-alikes and clutter of random shapes and colours, in new poses for each `shot`.

    `held_out` is for tests: another layout of panels and sockets, other light, and other kinds of clutter.
    """

    def __init__(
        self,
        cell: CableCell,
        rng: np.random.Generator,
        held_out: bool = False,
        renderer: RendererName = "software",
        parameters: RandomSceneParameters = RandomSceneParameters(),
    ) -> None:
        self._client: int = p.connect(p.DIRECT)
        self._cell, self._rng, self._parameters = cell, rng, parameters
        self._low, self._high = np.array(parameters.low), np.array(parameters.high)
        self._light = parameters.held_out_light if held_out else parameters.light
        self._known = repainted(rearranged(cell.known, rng) if held_out else cell.known, rng)
        self._walls = [build_box(self._client, box) for box in self._known.boxes]
        build_fixtures(self._client, self._known.cable)
        self._arms = {spec.name: self._make_arm(spec.name) for spec in cell.known.arms}
        connector, radius = cell.known.cable.connector, cell.hidden.cable.radius
        dark = random_color(rng, (0.02, 0.25))
        self._cable = make_cable(self._client, connector, similar_color(connector.color, rng), radius, dark)
        other = contrasting_color(connector.color, rng)
        self._other = make_cable(self._client, connector, other, radius, random_color(rng))
        self._clutter = make_clutter(self._client, connector, rng, parameters.clutter, held_out)
        halves = rng.uniform([0.01, 0.01, 0.04], [0.06, 0.06, 0.2], (parameters.occluders, 3))
        colors = [random_color(rng) for _ in halves]
        self._pieces = [
            (visual_body(self._client, p.GEOM_BOX, color, halfExtents=half.tolist()), half)
            for color, half in zip(colors, halves, strict=True)
        ]
        self._visuals = Visuals(self._client)
        self._renderer = make_renderer(self._visuals, renderer)

    def close(self) -> None:
        """Free the client and the renderer."""
        self._renderer.close()
        p.disconnect(self._client)

    def shot(self, present: bool = True, measured: bool = False) -> Shot:
        """A new picture. If the connector is not `present`, only clutter is near the place where it would be.

        If `measured`, the occlusion is measured: for that the connector is drawn a second time, alone.
        """
        pose = self._pose_connector()
        spec, camera = self._pose_camera(pose.translation)
        k = spec.intrinsics
        self._lay_cables(pose, present)
        self._scatter(pose, camera, present)
        poses, light = self._visuals.snapshot(), self._light.draw(self._rng)
        image = self._renderer.render(poses, camera, k, light)
        mask, occlusion = image.ids == self._cable.end, float("nan")
        if measured and mask.any():
            alone = poses.copy()
            alone[self._visuals.ids != self._cable.end, :, 3] = OUT_OF_SIGHT.translation
            whole = self._renderer.render(alone, camera, k, light).ids == self._cable.end
            occlusion = 1.0 - np.count_nonzero(mask) / np.count_nonzero(whole)
        return Shot(painted(image, self._walls, self._rng), image.depth, mask, occlusion, spec, camera, pose)

    def _make_arm(self, name: str) -> SimArm:
        return SimArm(self._client, self._cell, name, self._rng)

    def _pose_connector(self) -> RigidTransform:
        """Pose the arms, and draw the connector's pose."""
        rng, length = self._rng, self._known.cable.connector.length
        for arm in self._arms.values():
            self._pose_arm(arm)
        parameters, draw = self._parameters, float(rng.random())
        plugged = parameters.plugged_share
        stowed = plugged + parameters.stowed_share
        if draw < plugged:
            return self._known.cable.sockets[int(rng.integers(len(self._known.cable.sockets)))].world_from_plug(length)
        if draw < stowed:
            return self._known.cable.clip.world_from_seat
        if draw < stowed + parameters.held_share:
            return self._in_hand()
        return RigidTransform.from_components(self._draw_position(), Rotation.random(rng=rng))

    def _pose_arm(self, arm: SimArm) -> None:
        rng, sleep = self._rng, self._cell.known.arm(arm.name).sleep
        deviation = np.array(self._parameters.arm_deviation)
        arm.place(np.array(sleep) if rng.random() < self._parameters.sleeping_share else rng.normal(0.0, deviation))
        arm.gripper.place_at(float(rng.uniform(0.018, 0.08)))

    def _in_hand(self) -> RigidTransform:
        """The connector's pose in the hand, with the arm posed so that it is in the connector's box."""
        rng, arm = self._rng, self._arms[self._known.cable.hand]
        tool = arm.tool_pose()
        for _ in range(30):  # choice: about three draws of four end outside the box
            self._pose_arm(arm)
            tool = arm.tool_pose()
            if np.all((tool.translation > self._low) & (tool.translation < self._high)):
                break
        slant = Rotation.from_euler("y", float(rng.choice([-90, 90]) + rng.normal(0, 10)), degrees=True)
        slide = [float(rng.uniform(-0.035, 0.035)), 0.0, 0.0]
        return tool * RigidTransform.from_rotation(slant) * RigidTransform.from_translation(slide)

    def _pose_camera(self, target: FloatArray) -> tuple[CameraSpec, RigidTransform]:
        """A camera and its world_from_camera: the rear camera near its place, or either camera at a random one."""
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
        anchor, away = self._known.cable.anchor
        self._cable.hide()
        if present:
            self._cable.lay(pose, anchor, away)
        self._other.hide()
        if rng.random() < 0.5:
            turn = Rotation.random(rng=rng)
            other_pose = RigidTransform.from_components(self._draw_position(), turn)
            self._other.lay(other_pose, self._draw_position(), away)

    def _draw_position(self) -> FloatArray:
        """A random position (3,) m in the connector's box."""
        return self._rng.uniform(self._low, self._high)

    def _scatter(self, pose: RigidTransform, camera: RigidTransform, present: bool) -> None:
        """Place some of the clutter, half of it near the connector, and foam in front of the connector."""
        rng = self._rng
        for thing in self._clutter:
            center = pose.translation + rng.normal(0, 0.1, 3) if rng.random() < 0.5 else self._draw_position()
            shown = rng.random() < 0.4
            pose_of_thing = OUT_OF_SIGHT
            if shown:
                pose_of_thing = RigidTransform.from_components(center, Rotation.random(rng=rng))
            thing.set_pose(self._client, pose_of_thing)
        for body, _ in self._pieces:
            upright = Rotation.from_euler("z", float(rng.uniform(0, 180)), degrees=True)
            center = rng.uniform([0.1, -0.4, 0.0], [0.45, 0.4, 0.3])
            pose_of_piece = RigidTransform.from_components(center, upright)
            set_pose(self._client, body, pose_of_piece if rng.random() < 0.3 else OUT_OF_SIGHT)
        if rng.random() < self._parameters.occluded_share:
            body, half = self._pieces[int(rng.integers(len(self._pieces)))]
            set_pose(self._client, body, self._in_front(pose, camera, half))

    def _in_front(self, pose: RigidTransform, camera: RigidTransform, half: FloatArray) -> RigidTransform:
        """A pose of a box with half edges `half` (3,) m in which it occludes a part of the connector for the camera."""
        rng = self._rng
        axis = pose.rotation.apply([1.0, 0.0, 0.0])
        ray = pose.translation - camera.translation
        ray /= np.linalg.norm(ray)
        side = axis - (axis @ ray) * ray  # in the image, along the connector
        side *= float(rng.choice([-1, 1])) / max(float(np.linalg.norm(side)), 1e-6)
        edge = pose.translation + float(rng.uniform(-0.4, 0.45)) * self._known.cable.connector.length * side
        turn = Rotation.from_euler("z", float(rng.uniform(0, 180)), degrees=True)
        if rng.random() < 0.5:  # square to the connector in the image, as its edge
            turn = Rotation.from_matrix(np.column_stack([-side, np.cross(ray, -side), ray]))
        reach = float(np.abs(turn.inv().apply(side)) @ half)
        depth = float(np.abs(turn.inv().apply(ray)) @ half)
        return RigidTransform.from_components(edge + reach * side - (depth + rng.uniform(0.012, 0.1)) * ray, turn)
