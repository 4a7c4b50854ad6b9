"""The faults of the cable task, and what its faults may wait for."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from regrasp.interfaces.fault import Fault, FractionRange, Lasting, When
from regrasp.interfaces.fields import Fraction, Vector, unit

Phase = Literal["unplugged", "carried", "lost", "settled", "regrasped"]


class CableWhen(When):
    """When a fault begins: exactly one of `at`, `carried`, `node` and `phase`. Each fault begins once."""

    SHARES: ClassVar[tuple[str, ...]] = ("carried",)

    carried: FractionRange | None = Field(
        default=None,
        description="Share of the straight line from socket to clip that the held connector has moved along; "
        "drawn from this range.",
        json_schema_extra=unit("of the way"),
        examples=[[0.3, 0.6]],
    )
    phase: Phase | None = Field(
        default=None,
        description="By ground truth: the plug is out; the held connector is 0.1 m from its socket; no pad has touched "
        "it for 0.2 s; after that it is at rest; both pads hold it again.",
        examples=["settled"],
    )


class ConnectorKnocked(Fault):
    """A push on the connector's centre: a constant force for 20 ms."""

    type: Literal["connector_knocked"] = Field(description="This fault.", examples=["connector_knocked"])
    impulse: Vector = Field(
        description="Newton seconds along x, y and z, each at most 5.",
        json_schema_extra=unit("N s"),
        examples=[[0.0, 0.1, 0.05]],
    )


class CableSnags(Lasting):
    """The cable catches on something: a soft spring ties one of its links to the place where it was."""

    type: Literal["cable_snags"] = Field(description="This fault.", examples=["cable_snags"])
    along: Fraction = Field(
        default=0.6, description="Share of the cable's length from its fixed end to the link.", examples=[0.6]
    )
    stiffness: Annotated[float, Field(gt=0, le=2000)] = Field(
        default=100.0, description="Newtons a metre.", json_schema_extra=unit("N/m"), examples=[100.0]
    )
    max_force: Annotated[float, Field(gt=0, le=200)] = Field(
        default=20.0,
        description="Largest force of the spring in newtons.",
        json_schema_extra=unit("N"),
        examples=[20.0],
    )


FAULTS: tuple[type[Fault], ...] = (ConnectorKnocked, CableSnags)
