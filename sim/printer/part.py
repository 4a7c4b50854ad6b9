"""The printed part on its build plate: what bonds it there, and the catch that holds the plate."""

import math
from collections.abc import Callable

import numpy as np
import pybullet as p
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cell import Box
from regrasp.interfaces.printer.cell import Bond, HiddenPrinter, KnownPrinter
from regrasp.sim.bodies import BodyLink, box_shapes
from regrasp.sim.engine import Engine
from regrasp.sim.hold import Catch, Hold
from regrasp.sim.robot.arm import SimArm
from regrasp.sim.robot.model import pad_links

_INTO = Rotation.from_euler("z", 180.0, degrees=True)  # from the part's x axis, which points out of the printer
_OUT = (1.0, 0.0, 0.0)  # the way out of the printer, world


class PartBond:
    """The bond between a part and the plate under it. It breaks once it bears more than `limits`, and stays broken.

    `hold` is a constraint between the two whose link has the plate's axes and whose pivot lies in the middle of the
    bond. A pressure breaks nothing.
    """

    def __init__(self, hold: Hold, limits: Bond) -> None:
        self._hold: Hold | None = hold
        self._limits = limits

    @property
    def holds(self) -> bool:
        """Whether the part is still bonded."""
        return self._hold is not None

    def release(self) -> None:
        """Break it."""
        if self._hold is not None:
            self._hold.release()
            self._hold = None

    def step(self, normal: Callable[[], tuple[float, float, float]]) -> bool:
        """Whether it breaks now; call after every physics step. `normal` tells the plate's, in the world's axes."""
        if self._hold is None:
            return False
        x, y, z, about_x, about_y, about_z = self._hold.wrench()
        limits = self._limits
        over = math.hypot(about_x, about_y) > limits.tilt or abs(about_z) > limits.twist
        if not over and math.hypot(x, y, z) > min(limits.shear, limits.normal):
            nx, ny, nz = normal()
            along = x * nx + y * ny + z * nz
            shear = math.sqrt(max(x * x + y * y + z * z - along * along, 0.0))
            # The part is the constraint's parent: a pull up on it reads as a force down.
            over = shear > limits.shear or -along > limits.normal
        if over:
            self.release()
        return over


class SimPart:
    """The part with its gripping section, bonded to the plate, and the plate in its catch.

    `section_link` is the section's link of the body `part`. The catch lets the plate go out of the printer, along x.
    """

    section_link = 0

    def __init__(self, engine: Engine, known: KnownPrinter, hidden: HiddenPrinter) -> None:
        self._engine, self._known = engine, known.part
        self.plate = self._build_plate(known, hidden)
        self.part = self._build_part(known, hidden)
        engine.let_pass(self.part, -1, self.plate)  # as long as it is bonded
        plate_at, part_at = RigidTransform.from_translation(known.plate.center), _place(known, hidden)
        self.catch = Catch(Hold(BodyLink(engine.client, self.plate), plate_at), -np.array(_OUT), hidden.catch_force)
        foot = (0.0, 0.0, -0.5 * known.part.size[2])
        self._on_plate = plate_at.inv() * part_at
        hold = Hold(BodyLink(engine.client, self.part), self._on_plate, base=self.plate, pivot=foot)
        self._hold, self._foot = hold, np.array(foot)
        self.bond = PartBond(hold, hidden.bond)

    def pose(self, body: int) -> RigidTransform:
        """The true pose of the plate's or the part's middle, world_from_body."""
        position, quaternion = p.getBasePositionAndOrientation(body, physicsClientId=self._engine.client)
        return RigidTransform.from_components(position, Rotation.from_quat(quaternion))

    def front(self) -> RigidTransform:
        """The true pose of the middle of the section's front, world_from_front: x points into the part, z up."""
        section, part = self._known.section, self._known
        off = np.subtract(section.center, part.center) + np.array([0.5 * section.size[0], 0.0, 0.0])
        return self.pose(self.part) * RigidTransform.from_components(off, _INTO)

    def speed(self) -> float:
        """The part's speed, m/s."""
        return float(np.linalg.norm(p.getBaseVelocity(self.part, physicsClientId=self._engine.client)[0]))

    def held_by(self, arm: SimArm) -> bool:
        """Whether both pads of an arm's gripper touch the section."""
        pads = [arm.links[name] for name in pad_links(arm.robot.gripper)]
        return all(
            p.getContactPoints(arm.body, self.part, pad, self.section_link, physicsClientId=self._engine.client)
            for pad in pads
        )

    def float_off(self, velocity: FloatArray | None) -> None:
        """Break the bond, and let the part move with (3,) m/s, without turning; None: leave its motion as it is."""
        if self.bond.holds:
            self.bond.release()
            self._engine.let_meet(self.part, -1, self.plate)
        if velocity is not None:
            client = self._engine.client
            p.resetBaseVelocity(self.part, velocity.tolist(), [0.0, 0.0, 0.0], physicsClientId=client)

    def slide(self, way: FloatArray) -> None:
        """Move the bonded part by (3,) m on the plate from where it was printed; a broken bond moves nothing."""
        if self.bond.holds:
            at = self._on_plate * RigidTransform.from_translation(self._foot)
            quaternion = at.rotation.as_quat().tolist()
            self._hold.move((at.translation + way).tolist(), quaternion)

    def take_away(self) -> None:
        """Put the part out of everyone's sight, under the floor."""
        self.float_off(None)
        away = RigidTransform.from_translation([0.0, 0.0, -2.0])
        position = away.translation.tolist()
        p.resetBasePositionAndOrientation(self.part, position, [0, 0, 0, 1], physicsClientId=self._engine.client)
        Hold(BodyLink(self._engine.client, self.part), away)

    def step(self) -> None:
        """Check what holds the two; call after every physics step."""
        self.catch.step()
        if self.bond.step(self._normal):
            self._engine.let_meet(self.part, -1, self.plate)

    def _normal(self) -> tuple[float, float, float]:
        x, y, z, w = p.getBasePositionAndOrientation(self.plate, physicsClientId=self._engine.client)[1]
        return 2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)

    def _build_plate(self, known: KnownPrinter, hidden: HiddenPrinter) -> int:
        plate, client = known.plate, self._engine.client
        box = Box(name="plate", center=plate.center, size=plate.size, color=plate.color)
        collision, visual = box_shapes(client, box)
        body = int(p.createMultiBody(hidden.plate_mass, collision, visual, box.center, physicsClientId=client))
        self._loose(body, -1, hidden.plate_friction)
        return body

    def _build_part(self, known: KnownPrinter, hidden: HiddenPrinter) -> int:
        part, section = known.part.blocks()
        client, level, place = self._engine.client, [0.0, 0.0, 0.0, 1.0], _place(known, hidden)
        shapes = [box_shapes(client, block) for block in (part, section)]
        volumes = np.prod([part.size, section.size], axis=1)
        masses = hidden.part_mass * volumes / volumes.sum()
        body = int(
            p.createMultiBody(
                float(masses[0]),
                *shapes[0],
                place.translation.tolist(),
                place.rotation.as_quat().tolist(),
                linkMasses=[float(masses[1])],
                linkCollisionShapeIndices=[shapes[1][0]],
                linkVisualShapeIndices=[shapes[1][1]],
                linkPositions=[np.subtract(section.center, part.center).tolist()],
                linkOrientations=[level],
                linkInertialFramePositions=[[0.0, 0.0, 0.0]],
                linkInertialFrameOrientations=[level],
                linkParentIndices=[0],
                linkJointTypes=[p.JOINT_FIXED],
                linkJointAxis=[[0, 0, 1]],
                physicsClientId=client,
            )
        )
        for link in (-1, self.section_link):
            self._loose(body, link, hidden.part_friction)
        return body

    def _loose(self, body: int, link: int, friction: float) -> None:
        """What moves without air about it: no damping."""
        p.changeDynamics(
            body,
            link,
            lateralFriction=friction,
            linearDamping=0.0,
            angularDamping=0.0,
            physicsClientId=self._engine.client,
        )


def _place(known: KnownPrinter, hidden: HiddenPrinter) -> RigidTransform:
    """world_from_part where it was truly printed."""
    turn = Rotation.from_euler("z", hidden.part_yaw_deg, degrees=True)
    return RigidTransform.from_components(np.add(known.part.center, [*hidden.part_off, 0.0]), turn)
