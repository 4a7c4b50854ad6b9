"""The faults that a scenario file may name, as pydantic models."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from interfaces.cell import Fraction, Model


class JawOpensSpec(Model):
    """The jaw opens for `seconds` at a share of the way from socket to clip, drawn from the seed within `carried`."""

    type: Literal["jaw_opens"]
    carried: tuple[Fraction, Fraction]
    seconds: Annotated[float, Field(gt=0, le=60)] = 1.0

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.carried[0] > self.carried[1]:
            raise ValueError("carried runs backwards; put the smaller share first, such as [0.3, 0.8]")
        return self


FaultSpec = JawOpensSpec
