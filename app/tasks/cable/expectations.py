"""The expectations of a cable scenario as a pydantic model."""

from typing import Annotated, Literal

from pydantic import Field

from regrasp.app.task import expect
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


class Expect(expect.Expect):
    """What must come out, by ground truth; what is left out is not looked at."""

    end: Annotated[
        EndState | None,
        Field(
            description="Where the connector is then, by ground truth; left out: plugged with a `socket`, else stowed "
            "if the outcome is success.",
            examples=["plugged"],
        ),
    ] = None
    socket: Annotated[
        str | None,
        Field(description="Name of the socket that holds the connector then.", examples=["back_5"]),
        expect.CellName("free_socket"),
    ] = None
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
        if self.end is None and self.socket is not None:
            return "plugged"
        return "stowed" if self.end is None and self.outcome == "success" else self.end
