"""The expectations of a printer scenario as a pydantic model."""

from typing import Annotated

from pydantic import Field

from regrasp.app.task import expect
from regrasp.interfaces.fields import NotNegative


class Expect(expect.Expect):
    """What must come out, by ground truth; what is left out is not looked at."""

    door_open: Annotated[
        NotNegative | None, Field(description="Metres at least that the door stands open then.", examples=[0.41])
    ] = None
    door_closed: Annotated[
        bool | None, Field(description="Whether the door is closed then, to 1 cm.", examples=[True])
    ] = None
    part_in_tray: Annotated[
        bool | None,
        Field(
            description="Whether the part lies in the tray then, or floats over it, up to 10 cm high and below 1 cm/s.",
            examples=[True],
        ),
    ] = None
    plate_in_clamp: Annotated[
        bool | None,
        Field(description="Whether the clamp holds the plate then, to 1 cm of its middle.", examples=[True]),
    ] = None
    part_held: Annotated[
        bool | None,
        Field(description="Whether both pads touch the part's gripping section then.", examples=[True]),
    ] = None
