"""The printer task's sections of a cell file, `known.printer` and `hidden.printer`. Units are SI."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from regrasp.interfaces.cell import Box, Cell, KnownCell, Name
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
    handle: Handle
    color: Color = (0.55, 0.70, 0.80)

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


class KnownPrinter(Model):
    """What the robot is told about the printer, and which arm works at it."""

    hand: Name
    camera: Name  # on the hand's arm
    door: Door


Offset = Annotated[float, Field(ge=-0.1, le=0.1)]  # metres


class HiddenPrinter(Model):
    """What only the world knows of the printer."""

    door_mass: Mass
    door_friction: Force  # Coulomb's, of the slide
    handle_friction: Friction  # coefficient
    handle_off: tuple[Offset, Offset] = (0.0, 0.0)  # m along y and z from where the robot believes it


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
