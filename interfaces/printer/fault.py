"""The faults of the printer task, and what its faults may wait for."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from regrasp.interfaces.fault import Fault, FractionRange, Lasting, When

Way = Annotated[float, Field(ge=-0.05, le=0.05)]  # metres
Speed = Annotated[float, Field(ge=-0.2, le=0.2)]  # metres a second


class PrinterWhen(When):
    """When a fault begins: exactly one of `at`, `opened` and `node`. Each fault begins once."""

    SHARES: ClassVar[tuple[str, ...]] = ("opened",)

    opened: FractionRange | None = Field(
        default=None,
        description="Share of its travel that the door has been opened; drawn from this range.",
        examples=[[0.3, 0.6]],
    )


class DoorJams(Lasting):
    """The slide of the door jams: its friction grows."""

    type: Literal["door_jams"] = Field(description="This fault.", examples=["door_jams"])
    friction: Annotated[float, Field(gt=0, le=2000)] = Field(
        default=300.0, description="Newtons that the slide resists with then.", examples=[300.0]
    )


class HandleMoves(Fault):
    """The handle's mount slips: the handle slides along the door and stays there."""

    type: Literal["handle_moves"] = Field(description="This fault.", examples=["handle_moves"])
    by: Annotated[float, Field(ge=-0.05, le=0.05)] = Field(
        default=0.02, description="Metres along the door; positive the way it opens.", examples=[0.02]
    )


class PartKnocked(Fault):
    """Something knocks the printed part: it slides on its plate, to which it stays bonded."""

    type: Literal["part_knocked"] = Field(description="This fault.", examples=["part_knocked"])
    by: tuple[Way, Way] = Field(
        default=(0.0, 0.02), description="Metres along x and y from where it was printed.", examples=[[0.0, 0.02]]
    )


class PartFloats(Lasting):
    """The bond of the printed part breaks, and the part drifts, without turning, as long as the fault lasts."""

    type: Literal["part_floats"] = Field(description="This fault.", examples=["part_floats"])
    velocity: tuple[Speed, Speed, Speed] = Field(
        default=(0.0, 0.014, 0.014), description="Metres a second along x, y and z.", examples=[[0.0, 0.014, 0.014]]
    )


class PartTaken(Fault):
    """Somebody takes the printed part away."""

    type: Literal["part_taken"] = Field(description="This fault.", examples=["part_taken"])


FAULTS: tuple[type[Fault], ...] = (DoorJams, HandleMoves, PartFloats, PartKnocked, PartTaken)
