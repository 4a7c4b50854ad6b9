"""The printer task's sections of a cell file, `known.printer` and `hidden.printer`. Units are SI."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from regrasp.interfaces.cell import Box, Cell, KnownCell, Name, Region
from regrasp.interfaces.fields import Color, Force, Friction, Length, Mass, Model, Size, Vector
from regrasp.interfaces.hidden_world import HiddenWorld


class Handle(Model):
    """An upright bar that stands before the door and moves with it."""

    center: Vector  # where the door is closed
    size: Size
    color: Color = (0.90, 0.60, 0.10)  # one that no other thing of the cell has: it is found by that


class Door(Model):
    """A door that slides along the world's y before the printer's opening. Its edges lie along the world's axes."""

    center: Vector  # where it is closed
    size: Size
    travel: Length  # along y from closed to open
    opening: Annotated[float, Field(ge=0.0, le=10.0)] = 0.0  # m that it stands open at first
    handle: Handle
    color: Color = (0.55, 0.70, 0.80)

    @model_validator(mode="after")
    def _opens_so_far(self) -> Self:
        if self.opening > self.travel:
            raise ValueError(f"opening {self.opening:g} is more than the door's travel, {self.travel:g}; give less")
        return self

    @model_validator(mode="after")
    def _handle_before_the_door(self) -> Self:
        front = self.center[0] + 0.5 * self.size[0]
        back = self.handle.center[0] - 0.5 * self.handle.size[0]
        if back < front:
            raise ValueError(
                f"the handle's back, at x {back:g}, lies in the door, whose front is at {front:g}; move the handle "
                f"further along x"
            )
        for axis, name in ((1, "y"), (2, "z")):
            off = abs(self.handle.center[axis] - self.center[axis])
            if off > 0.5 * (self.size[axis] - self.handle.size[axis]):
                raise ValueError(
                    f"the handle stands out of the door along {name}; move its center nearer to the door's"
                )
        return self

    def parts(self, opening: float) -> tuple[Box, Box]:
        """The door and its handle, where it stands `opening` m open."""
        return (
            Box(name="door", center=_along_y(self.center, opening), size=self.size, color=self.color),
            Box(
                name="door_handle",
                center=_along_y(self.handle.center, opening),
                size=self.handle.size,
                color=self.handle.color,
            ),
        )


def _along_y(center: Vector, way: float) -> Vector:
    return (center[0], center[1] + way, center[2])


class Plate(Model):
    """The build plate, where the printer's catch holds it."""

    center: Vector
    size: Size
    color: Color = (0.55, 0.55, 0.58)


class Section(Model):
    """The gripping section: the block before the part by which a gripper takes it."""

    center: Vector
    size: Size
    color: Color = (0.10, 0.25, 0.85)  # one that no other thing of the cell has: it is found by that


class PrintedPart(Model):
    """A printed part, bonded to the plate on which it stands, with its gripping section."""

    center: Vector
    size: Size
    section: Section
    color: Color = (0.85, 0.10, 0.10)  # as the section's

    def blocks(self) -> tuple[Box, Box]:
        """The part and its gripping section, where they were printed."""
        section = self.section
        return (
            Box(name="part", center=self.center, size=self.size, color=self.color),
            Box(name="section", center=section.center, size=section.size, color=section.color),
        )


class Clamp(Model):
    """A clamp on the desk: two jaws that close along y on a plate between them.

    The plate's center is where it lies then. The jaws are as long as `jaw_size` says, and their tops stand `above` m
    over the plate's.
    """

    center: Vector
    jaw_size: Size
    stroke: Length  # of each jaw, from the plate's edge outwards
    above: Annotated[float, Field(ge=-0.01, le=0.05)]
    color: Color = (0.15, 0.16, 0.18)


class KnownPrinter(Model):
    """What the robot is told about the printer, and which arm works at it."""

    hand: Name
    camera: Name  # on the hand's arm
    opening: Region  # of the chamber behind the door
    door: Door
    plate: Plate
    part: PrintedPart
    clamp: Clamp

    def fixtures(self) -> tuple[Box, ...]:
        """Plate, part and open clamp as an arm must keep clear of them, before anything was moved."""
        plate, clamp = self.plate, self.clamp
        x, y, z = clamp.center
        out = 0.5 * (plate.size[1] + clamp.jaw_size[1]) + clamp.stroke
        up = z + 0.5 * (plate.size[2] - clamp.jaw_size[2]) + clamp.above
        jaws = (
            Box(name=f"clamp_{side}", center=(x, y + way, up), size=clamp.jaw_size, color=clamp.color)
            for side, way in (("left", -out), ("right", out))
        )
        on = Box(name="plate", center=plate.center, size=plate.size, color=plate.color)
        return (on, *self.part.blocks(), *jaws)


Torque = Annotated[float, Field(ge=1e-3, le=1e3)]  # newton metres
Offset = Annotated[float, Field(ge=-0.1, le=0.1)]  # metres


class Bond(Model):
    """Forces (N) and torques (N m) above which the bond between part and plate breaks."""

    shear: Force  # along the plate
    normal: Force  # away from the plate
    tilt: Torque  # about axes in the plate
    twist: Torque  # about the plate's normal


class HiddenPrinter(Model):
    """What only the world knows of the printer."""

    door_mass: Mass
    door_friction: Force  # Coulomb's, of the slide
    handle_friction: Friction  # coefficient
    handle_off: tuple[Offset, Offset] = (0.0, 0.0)  # m along y and z from where the robot believes it
    part_off: tuple[Offset, Offset] = (0.0, 0.0)  # m along x and y on the plate from where the robot believes it
    part_yaw_deg: Annotated[float, Field(ge=-45.0, le=45.0)] = 0.0  # that it is turned to the left
    plate_mass: Mass
    part_mass: Mass  # with its gripping section
    plate_friction: Friction  # coefficient, of the plate on what it lies on or what clamps it
    part_friction: Friction  # coefficient, of the part and its section
    catch_force: Force  # with which the catch holds the plate against being drawn out
    clamp_force: Force  # of each jaw
    bond: Bond


class PrinterKnown(KnownCell):
    """The known part of a cell with a printer."""

    printer: KnownPrinter


class PrinterHidden(HiddenWorld):
    """The hidden part of a cell with a printer."""

    printer: HiddenPrinter


class PrinterCell(Cell):
    """A cell with a printer."""

    known: PrinterKnown
    hidden: PrinterHidden
