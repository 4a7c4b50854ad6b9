"""The expectations of a cable scenario as pydantic models."""

from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from regrasp.app.records.result import OLD_OUTCOMES
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.fields import Model, NotNegative

EndState = Literal["stowed", "plugged", "held", "lost"]


class PoseError(Model):
    """How far the connector may end from its seat in the clip; what is left out is not looked at."""

    position: Annotated[
        NotNegative | None, Field(description="Metres at most between the centres.", examples=[0.01])
    ] = None
    angle_deg: Annotated[
        NotNegative | None, Field(description="Degrees at most between the axes.", examples=[10.0])
    ] = None


class Expect(Model):
    """What must come out, by ground truth; what is left out is not looked at."""

    outcome: Annotated[
        Literal["success", "failure"], Field(description="How the tree ends the run.", examples=["failure"])
    ] = "success"
    end: Annotated[
        EndState | None,
        Field(
            description="Where the connector is then, by ground truth; left out: stowed if the outcome is success.",
            examples=["plugged"],
        ),
    ] = None
    cause: Annotated[CauseCode | None, Field(description="Why it failed.", examples=["search_exhausted"])] = None
    sim_seconds: Annotated[NotNegative | None, Field(description="Simulated seconds at most.", examples=[120.0])] = None
    tries: Annotated[
        int | None,
        Field(ge=1, le=100, description="How often the hand takes hold at most; unplugging is one.", examples=[2]),
    ] = None
    slips: Annotated[
        int | None,
        Field(ge=0, le=20, description="Losses that the robot notices at least; none may go unseen.", examples=[1]),
    ] = None
    detection_delay: Annotated[
        NotNegative | None, Field(description="Seconds at most from a loss to its notice.", examples=[0.5])
    ] = None
    hidden: Annotated[
        bool | None,
        Field(
            description="Whether the lost end settles out of the rear camera's sight and the wrist camera finds it.",
            examples=[True],
        ),
    ] = None
    unintended_force: Annotated[
        NotNegative | None,
        Field(description="Newtons at most between an arm and what it must not touch, all along.", examples=[5.0]),
    ] = None
    pose_error: Annotated[
        PoseError | None,
        Field(
            description="How far the connector ends from its seat in the clip.",
            examples=[{"position": 0.01, "angle_deg": 10.0}],
        ),
    ] = None

    @property
    def end_state(self) -> EndState | None:
        """`end`, or what it is when it is left out."""
        return "stowed" if self.end is None and self.outcome == "success" else self.end

    @field_validator("outcome", mode="before")
    @classmethod
    def _of_schema_1(cls, word: object) -> object:
        return OLD_OUTCOMES.get(word, word) if isinstance(word, str) else word

    @model_validator(mode="after")
    def _cause_of_a_failure(self) -> Self:
        if self.cause is not None and self.outcome == "success":
            raise ValueError("a run that ends in success has no cause; write outcome: failure beside cause")
        return self
