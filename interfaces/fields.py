"""Number types with bounds, and the base class of everything that is read from a file.

The bounds are wide: a number beyond them is a slip of the pen, and arithmetic overflows on some of them.
"""

from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field

Number = Annotated[float, Field(allow_inf_nan=False, strict=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Fraction = Annotated[float, Field(ge=0, le=1)]
Seconds = Annotated[float, Field(ge=0, le=10)]
Length = Annotated[float, Field(ge=1e-4, le=10)]  # metres
Deviation = Annotated[float, Field(ge=0, le=1)]  # standard deviation of a position, metres
Coordinate = Annotated[float, Field(ge=-5, le=5, allow_inf_nan=False)]  # metres in the world
MountOffset = Annotated[float, Field(ge=-0.3, le=0.3)]  # metres in the frame of the link that carries a camera
Force = Annotated[float, Field(ge=1e-3, le=1e4)]  # newtons
Mass = Annotated[float, Field(ge=1e-5, le=100)]  # kilograms, or kilograms a metre
Friction = Annotated[float, Field(ge=1e-3, le=10)]  # coefficient
JointAngle = Annotated[float, Field(ge=-7, le=7)]  # radians
SignedDegrees = Annotated[float, Field(ge=-360, le=360)]
UnsignedDegrees = Annotated[float, Field(ge=0, le=180)]
Vector = tuple[Coordinate, Coordinate, Coordinate]
Size = tuple[Length, Length, Length]
Color = tuple[Fraction, Fraction, Fraction]  # RGB


def unit(symbol: str) -> dict[str, Any]:
    """For a field's `json_schema_extra`: the unit of its number, which a report writes behind it."""
    return {"unit": symbol}


def _not_zero(v: Vector) -> Vector:
    if float(np.linalg.norm(v)) < 1e-6:
        raise ValueError("a direction must not be zero")
    return v


Direction = Annotated[Vector, AfterValidator(_not_zero)]  # of any length


def in_order(span: tuple[float, float]) -> tuple[float, float]:
    """The range, if its ends are in order. Raises ValueError."""
    if span[0] > span[1]:
        raise ValueError("runs backwards; put the smaller first, such as [0.3, 0.8]")
    return span


class Model(BaseModel):
    """Base class of all file models. Unknown keys are errors; an object does not change once it is made."""

    model_config = ConfigDict(extra="forbid", frozen=True)
