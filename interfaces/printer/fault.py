"""The faults of the printer task, and what its faults may wait for."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from regrasp.interfaces.fault import Fault, FractionRange, Lasting, When
from regrasp.interfaces.fields import unit

Way = Annotated[float, Field(ge=-0.05, le=0.05)]  # metres
Speed = Annotated[float, Field(ge=-0.2, le=0.2)]  # metres a second


class PrinterWhen(When):
    """When a fault begins: exactly one of `at`, `opened` and `node`. Each fault begins once."""

    SHARES: ClassVar[tuple[str, ...]] = ("opened",)

    opened: FractionRange | None = Field(
        default=None,
        description="Share of its travel that the door has been opened; drawn from this range.",
        json_schema_extra=unit("of the way"),
        examples=[[0.3, 0.6]],
    )


class DoorJams(Lasting):
    """The slide of the door jams: its friction grows."""

    type: Literal["door_jams"] = Field(description="This fault.", examples=["door_jams"])
    friction: Annotated[float, Field(gt=0, le=2000)] = Field(
        default=300.0,
        description="Newtons that the slide resists with then.",
        json_schema_extra=unit("N"),
        examples=[300.0],
    )


class HandleMoves(Fault):
    """The handle's mount slips: the handle slides along the door and stays there."""

    type: Literal["handle_moves"] = Field(description="This fault.", examples=["handle_moves"])
    by: Annotated[float, Field(ge=-0.05, le=0.05)] = Field(
        default=0.02,
        description="Metres along the door; positive the way it opens.",
        json_schema_extra=unit("m"),
        examples=[0.02],
    )


class PartKnocked(Fault):
    """Something knocks the printed part: it slides on its plate, to which it stays bonded."""

    type: Literal["part_knocked"] = Field(description="This fault.", examples=["part_knocked"])
    by: tuple[Way, Way] = Field(
        default=(0.0, 0.02),
        description="Metres along x and y from where it was printed.",
        json_schema_extra=unit("m"),
        examples=[[0.0, 0.02]],
    )


class PartFloats(Lasting):
    """The bond of the printed part breaks, and the part drifts, without turning, as long as the fault lasts."""

    type: Literal["part_floats"] = Field(description="This fault.", examples=["part_floats"])
    velocity: tuple[Speed, Speed, Speed] = Field(
        default=(0.0, 0.014, 0.014),
        description="Metres a second along x, y and z.",
        json_schema_extra=unit("m/s"),
        examples=[[0.0, 0.014, 0.014]],
    )


class PartTaken(Fault):
    """Somebody takes the printed part away."""

    type: Literal["part_taken"] = Field(description="This fault.", examples=["part_taken"])


class BondBreaks(Fault):
    """The bond between the printed part and its plate breaks; neither is pushed."""

    type: Literal["bond_breaks"] = Field(description="This fault.", examples=["bond_breaks"])


class PlateSticks(Fault):
    """The catch holds the plate harder than it should."""

    type: Literal["plate_sticks"] = Field(description="This fault.", examples=["plate_sticks"])
    force: Annotated[float, Field(gt=0, le=2000)] = Field(
        default=15.0,
        description="Newtons along x at which it lets go then.",
        json_schema_extra=unit("N"),
        examples=[15.0],
    )


class DoorCloses(Fault):
    """Somebody closes the door."""

    type: Literal["door_closes"] = Field(description="This fault.", examples=["door_closes"])
    force: Annotated[float, Field(gt=0, le=200)] = Field(
        default=20.0,
        description="Newtons at most with which it is pushed.",
        json_schema_extra=unit("N"),
        examples=[20.0],
    )


FAULTS: tuple[type[Fault], ...] = (
    BondBreaks,
    DoorCloses,
    DoorJams,
    HandleMoves,
    PartFloats,
    PartKnocked,
    PartTaken,
    PlateSticks,
)
