"""What a scenario of any task may expect, as a pydantic model."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, field_validator, model_validator

from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.fields import Model, NotNegative


@dataclass(frozen=True)
class CellName:
    """Marks a field that holds a name of the cell, of a kind that the task's `cell_names` tell."""

    kind: str


class Expect(Model):
    """What must come out, by ground truth; what is left out is not looked at."""

    OLD_OUTCOMES: ClassVar[Mapping[str, str]] = {}  # of scenarios of schema 1, and what is written today

    outcome: Annotated[
        Literal["success", "failure"], Field(description="How the tree ends the run.", examples=["failure"])
    ] = "success"
    # A scenario's model takes the task's causes, too.
    cause: Annotated[CauseCode | None, Field(description="Why it failed.", examples=["planning_failed"])] = None
    sim_seconds: Annotated[NotNegative | None, Field(description="Simulated seconds at most.", examples=[120.0])] = None
    unintended_force: Annotated[
        NotNegative | None,
        Field(description="Newtons at most between an arm and what it must not touch, all along.", examples=[5.0]),
    ] = None

    @field_validator("outcome", mode="before")
    @classmethod
    def _of_schema_1(cls, word: object) -> object:
        return cls.OLD_OUTCOMES.get(word, word) if isinstance(word, str) else word

    @model_validator(mode="after")
    def _cause_of_a_failure(self) -> Self:
        if self.cause is not None and self.outcome == "success":
            raise ValueError("a run that ends in success has no cause; write outcome: failure beside cause")
        return self
