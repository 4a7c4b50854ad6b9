"""The expectations of a cable scenario as pydantic models."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.fields import Model, NotNegative


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
        Literal["stowed", "safe_stop"],
        Field(description="The end: connector in the clip, or arms stopped after a failure.", examples=["safe_stop"]),
    ] = "stowed"
    cause: Annotated[CauseCode | None, Field(description="Why a safe stop came.", examples=["search_exhausted"])] = None
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

    @model_validator(mode="after")
    def _cause_of_a_stop(self) -> Self:
        if self.cause is not None and self.outcome == "stowed":
            raise ValueError("a run that ends stowed has no cause; write outcome: safe_stop beside cause")
        return self
