"""Random pictures of the printed part by the hand's camera with its true boxes, to train and test a detector.

No physics runs. The arm is drawn as if it were moved as a whole, so that its hand is where a picture wants it.
"""

from dataclasses import dataclass, field

import numpy as np
import pybullet as p
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import Box, CameraSpec, WristMount
from regrasp.interfaces.printer.actions import CLASSES, PartClass
from regrasp.interfaces.printer.cell import PrinterCell, PrinterKnown
from regrasp.sim.bodies import OUT_OF_SIGHT, build_box
from regrasp.sim.random_scenes import (
    LightRange,
    contrasting_color,
    painted,
    random_color,
    set_pose,
    similar_color,
    visual_body,
)
from regrasp.sim.render.renderer import RendererName, make_renderer
from regrasp.sim.render.visuals import Visuals, segmentation_id
from regrasp.sim.robot.arm import SimArm
from regrasp.sim.robot.model import pad_links


@dataclass(frozen=True)
class PartSceneParameters:
    """Distribution of random scenes. All values are choices, but for the errors of the camera's mount."""

    distance: tuple[float, float] = (0.0, 0.6)  # m from the tool to the section's front
    aside: float = 0.22  # of the distance from the camera, standard deviation of the hand's place beside the part
    turn_deg: tuple[float, float, float] = (12.0, 8.0, 8.0)  # standard deviations of the hand's yaw, pitch and roll
    part_yaw_deg: float = 30.0  # to each side
    part_off: float = 0.03  # m to each side, along x and y
    occluded_share: float = 0.4  # of the pictures have a thing between the camera and the part
    clutter: int = 8  # things in a scene; a picture shows some of them
    shown_share: float = 0.35  # of the things in a picture
    look_alike_share: float = 0.5  # of the things have nearly the colour of the part or of its section
    own_share: float = 0.4  # of the scenes have the colours of the cell's file
    mount: tuple[float, float] = (0.002, 0.3)  # m and degrees, standard deviations of the camera's mount
    light: LightRange = field(default_factory=lambda: LightRange((0.6, -0.2, 1.0), (0.25, 0.75), (0.15, 0.7)))
    held_out_light: LightRange = field(default_factory=lambda: LightRange((-0.3, 1.2, 0.6), (0.2, 0.85), (0.05, 0.6)))


@dataclass(frozen=True, eq=False)
class PartShot:
    """A picture and its ground truth.

    Attributes:
        rgb: (H, W, 3) uint8.
        depth: (H, W) float32 m, without noise.
        masks: Of each class the pixels (H, W) that show it.
        occlusion: Share of the part's pixels, with its section's, that something occludes; NaN if it is absent or not
            measured.
        camera: The camera.
    """

    rgb: NDArray[np.uint8]
    depth: NDArray[np.float32]
    masks: dict[PartClass, NDArray[np.bool_]]
    occlusion: float
    camera: CameraSpec


class PartScene:
    """The cell with a part that was printed anywhere on its plate, look-alikes and clutter, anew for each `shot`.

    `held_out` is for tests: another chamber, other light, and other kinds of clutter.
    """

    def __init__(
        self,
        cell: PrinterCell,
        rng: np.random.Generator,
        held_out: bool = False,
        renderer: RendererName = "software",
        parameters: PartSceneParameters = PartSceneParameters(),
    ) -> None:
        self._client: int = p.connect(p.DIRECT)
        self._rng, self._parameters, known = rng, parameters, cell.known
        self._light = parameters.held_out_light if held_out else parameters.light
        self._printer = known.printer
        self.camera = next(c for c in known.cameras if c.name == known.printer.camera)
        boxes = _chamber(known, rng) if held_out else [*known.boxes, _plate(known)]
        opening = float(rng.uniform(0.6, 1.0)) * known.printer.door.travel
        boxes += known.printer.door.parts(opening)
        if rng.random() >= parameters.own_share:
            boxes = _repainted(boxes, rng)
        self._walls = [build_box(self._client, box) for box in boxes]
        self._section, self._part = (self._block(box, rng) for box in reversed(known.printer.part.blocks()))
        self._clutter = [self._thing(rng, held_out) for _ in range(parameters.clutter)]
        self._arm = SimArm(self._client, cell, known.printer.hand, rng)
        self._arm.place(np.array(known.arm(known.printer.hand).sleep))
        shift, turn = rng.normal(0.0, parameters.mount[0], 3), rng.normal(0.0, np.deg2rad(parameters.mount[1]), 3)
        self._mount_error = RigidTransform.from_components(shift, Rotation.from_rotvec(turn))
        self._visuals = Visuals(self._client)
        self._renderer = make_renderer(self._visuals, renderer)
        self._of_arm = np.array([item.body == self._arm.body for item in self._visuals.items])
        self._ids = self._class_ids(parent_links(self._client, self._arm.body))

    def close(self) -> None:
        """Free the client and the renderer."""
        self._renderer.close()
        p.disconnect(self._client)

    def shot(self, present: bool = True, measured: bool = False) -> PartShot:
        """A new picture. If the part is not `present`, only clutter is near the place where it would be.

        If `measured`, the occlusion is measured: for that the part is drawn a second time, alone.
        """
        rng = self._rng
        self._arm.gripper.place_at(float(rng.uniform(0.01, 0.08)))
        front = self._place_part(present)
        moved = self._hand_pose(front) * self._arm.tool_pose().inv()  # of the whole arm
        mount = self.camera.mount
        assert isinstance(mount, WristMount)
        camera = moved * self._arm.deferred_mount_pose()() * mount.mount_from_camera * self._mount_error
        self._scatter(front, camera)
        poses = self._visuals.snapshot().copy()
        poses[self._of_arm] = (moved.as_matrix()[:3, :3] @ poses[self._of_arm]).astype(np.float32)
        poses[self._of_arm, :, 3] += moved.translation.astype(np.float32)
        light = self._light.draw(rng)
        image = self._renderer.render(poses, camera, self.camera.intrinsics, light)
        masks = {name: np.isin(image.ids, self._ids[name]) for name in CLASSES}
        occlusion = float("nan")
        if present and measured:
            alone = poses.copy()
            others = ~np.isin(self._visuals.ids, [*self._ids["obj"], *self._ids["targ"]])
            alone[others, :, 3] = OUT_OF_SIGHT.translation
            whole = np.count_nonzero(self._renderer.render(alone, camera, self.camera.intrinsics, light).ids >= 0)
            seen = np.count_nonzero(masks["obj"] | masks["targ"])
            occlusion = 1.0 - seen / whole if whole else float("nan")
        return PartShot(painted(image, self._walls, rng), image.depth, masks, occlusion, self.camera)

    def _block(self, box: Box, rng: np.random.Generator) -> int:
        half = [0.5 * edge for edge in box.size]
        return visual_body(self._client, p.GEOM_BOX, similar_color(box.color, rng), halfExtents=half)

    def _thing(self, rng: np.random.Generator, held_out: bool) -> int:
        """Clutter. None is a block with the part's proportions, because nothing would tell it from one."""
        part = self._printer.part
        color = part.color if rng.random() < 0.5 else part.section.color
        draw = similar_color if rng.random() < self._parameters.look_alike_share else contrasting_color
        painted_as = draw(color, rng)
        kind = int(rng.integers(3))
        if held_out:  # a rod, a capsule or a can
            radius, length = ((0.003, 0.3), (0.012, 0.06), (0.03, 0.05))[kind]
            radius, length = radius * float(rng.uniform(0.7, 1.5)), length * float(rng.uniform(0.7, 1.5))
            shape = p.GEOM_CAPSULE if kind == 1 else p.GEOM_CYLINDER
            return visual_body(self._client, shape, painted_as, radius=radius, length=length)
        if kind == 0:
            return visual_body(self._client, p.GEOM_SPHERE, painted_as, radius=float(rng.uniform(0.008, 0.04)))
        if kind == 1:  # a pole
            radius, length = float(rng.uniform(0.004, 0.015)), float(rng.uniform(0.15, 0.5))
            return visual_body(self._client, p.GEOM_CYLINDER, painted_as, radius=radius, length=length)
        half = rng.uniform([0.02, 0.02, 0.001], [0.08, 0.08, 0.003])  # a plate
        return visual_body(self._client, p.GEOM_BOX, painted_as, halfExtents=half.tolist())

    def _class_ids(self, parents: dict[int, int]) -> dict[PartClass, list[int]]:
        """Segmentation ids of each class. The left finger is the one that lies left in the picture."""
        arm = self._arm
        chains = [_chain(parents, arm.links[name]) for name in pad_links(arm.robot.gripper)]
        shared = set(chains[0]) & set(chains[1])
        fingers = [
            [link for link in parents if link not in shared and set(_chain(parents, link)) & (set(c) - shared)]
            for c in chains
        ]
        mount = self.camera.mount
        assert isinstance(mount, WristMount)
        camera = (arm.deferred_mount_pose()() * mount.mount_from_camera).inv()
        places = [
            p.getLinkState(arm.body, arm.links[name], 0, 1, physicsClientId=self._client)[4]
            for name in pad_links(arm.robot.gripper)
        ]
        first_is_left = camera.apply(places[0])[0] < camera.apply(places[1])[0]
        left, right = fingers if first_is_left else fingers[::-1]
        return {
            "obj": [segmentation_id(self._part, -1)],
            "targ": [segmentation_id(self._section, -1)],
            "lgrip": [segmentation_id(arm.body, link) for link in left],
            "rgrip": [segmentation_id(arm.body, link) for link in right],
        }

    def _place_part(self, present: bool) -> RigidTransform:
        """Place the part, and tell world_from_front: x points into it from the middle of its section's front."""
        rng, part, values = self._rng, self._printer.part, self._parameters
        off = rng.uniform(-values.part_off, values.part_off, 2)
        yaw = float(rng.uniform(-values.part_yaw_deg, values.part_yaw_deg))
        turn = Rotation.from_euler("z", yaw, degrees=True)
        pose = RigidTransform.from_components(np.add(part.center, [*off, 0.0]), turn)
        beside = np.subtract(part.section.center, part.center)
        section = pose * RigidTransform.from_translation(beside)
        set_pose(self._client, self._part, pose if present else OUT_OF_SIGHT)
        set_pose(self._client, self._section, section if present else OUT_OF_SIGHT)
        into = Rotation.from_euler("z", 180.0, degrees=True)
        return section * RigidTransform.from_components([0.5 * part.section.size[0], 0.0, 0.0], into)

    def _hand_pose(self, front: RigidTransform) -> RigidTransform:
        """world_from_tool before the part, which need not be in the picture's middle, nor wholly in the picture."""
        rng, values = self._rng, self._parameters
        away = float(rng.uniform(*values.distance))
        aside = rng.normal(0.0, values.aside * (away + 0.15), 2) * [1.0, 0.6]
        # With a tilted hand the part stays in sight: the hand is turned about it.
        yaw, pitch, roll = rng.normal(0.0, values.turn_deg)
        level = RigidTransform.from_components(front.translation, Rotation.from_euler("z", 180.0, degrees=True))
        turn = RigidTransform.from_rotation(Rotation.from_euler("ZYX", [yaw, pitch, roll], degrees=True))
        return level * turn * RigidTransform.from_translation([-away, *aside])

    def _scatter(self, front: RigidTransform, camera: RigidTransform) -> None:
        """Place some of the things, half of them near the part, and now and then one in front of it."""
        rng, values = self._rng, self._parameters
        low, high = np.array(self._printer.opening.lower), np.array(self._printer.opening.upper)
        hiding = int(rng.integers(len(self._clutter))) if rng.random() < values.occluded_share else -1
        for i, body in enumerate(self._clutter):
            at: FloatArray = rng.uniform(low, high)
            if i == hiding:
                share = float(rng.uniform(0.5, 0.9))
                at = camera.translation + share * (front.translation - camera.translation) + rng.normal(0, 0.03, 3)
            elif rng.random() >= values.shown_share:
                set_pose(self._client, body, OUT_OF_SIGHT)
                continue
            elif rng.random() < 0.5:
                at = front.translation + rng.normal(0, 0.08, 3)
            set_pose(self._client, body, RigidTransform.from_components(at, Rotation.random(rng=rng)))


def parent_links(client: int, body: int) -> dict[int, int]:
    """The parent of each link of a body; -1 is the base."""
    count = p.getNumJoints(body, physicsClientId=client)
    return {link: int(p.getJointInfo(body, link, physicsClientId=client)[16]) for link in range(count)}


def _chain(parents: dict[int, int], link: int) -> list[int]:
    """The link and what it hangs on, without the base."""
    chain = []
    while link >= 0:
        chain.append(link)
        link = parents[link]
    return chain


def _plate(known: PrinterKnown) -> Box:
    plate = known.printer.plate
    return Box(name="plate", center=plate.center, size=plate.size, color=plate.color)


def _repainted(boxes: list[Box], rng: np.random.Generator) -> list[Box]:
    """Boxes in random colours, one for all of the printer's."""
    printer = random_color(rng, (0.1, 0.9))
    return [
        b.model_copy(update={"color": printer if b.name.startswith("printer") else random_color(rng)}) for b in boxes
    ]


def _chamber(known: PrinterKnown, rng: np.random.Generator) -> list[Box]:
    """The cell's boxes with those of the printer moved and resized, as another printer's would be, and its plate."""
    boxes = []
    for box in [*known.boxes, _plate(known)]:
        bed = box.name in ("plate", "plate_bed")
        size = np.array(box.size) * ([*rng.uniform(0.6, 1.3, 2), 1.0] if bed else rng.uniform(0.8, 1.2, 3))
        shift = np.zeros(3) if bed else rng.uniform([-0.08, -0.03, -0.03], [0.0, 0.03, 0.03])
        center = np.array(box.center) + shift
        boxes.append(box.model_copy(update={"center": tuple(center.tolist()), "size": tuple(size.tolist())}))
    return boxes
