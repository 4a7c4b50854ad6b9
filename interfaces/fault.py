"""The faults that a scenario file may ask for: when each begins, how long it lasts, and its numbers. SI units.

The file gives ranges for the beginning. `When.drawn` picks a value from each; a drawn range holds that value twice.
"""

from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from regrasp.interfaces.fields import Direction, Fraction, Model, Vector, in_order, unit

SimTime = Annotated[float, Field(ge=0, le=3600)]  # seconds
TimeRange = Annotated[tuple[SimTime, SimTime], AfterValidator(in_order)]
FractionRange = Annotated[tuple[Fraction, Fraction], AfterValidator(in_order)]
PositiveFraction = Annotated[float, Field(gt=0, le=1)]


class When(Model):
    """When a fault begins: exactly one of `at` and `node`. Each fault begins once.

    A task may add its phases as `phase`, a Literal, and shares of its progress as ranges whose names stand in `SHARES`.
    """

    SHARES: ClassVar[tuple[str, ...]] = ()

    at: TimeRange | None = Field(
        default=None,
        description="Simulated seconds; drawn from this range.",
        json_schema_extra=unit("s"),
        examples=[[5.0, 8.0]],
    )
    node: str | None = Field(
        default=None,
        description="A node of the tree is entered: its path, or the end of its path.",
        examples=["insert"],
    )
    after: TimeRange | None = Field(
        default=None,
        description="With `node`: seconds after it is entered; drawn from this range.",
        json_schema_extra=unit("s"),
        examples=[[0.5, 1.5]],
    )

    @model_validator(mode="after")
    def _one(self) -> Self:
        choices = ["at", *self.SHARES, "node", *(["phase"] if "phase" in type(self).model_fields else [])]
        given = [name for name in choices if getattr(self, name) is not None]
        if len(given) != 1:
            told = " and ".join(given) or "nothing"
            raise ValueError(f"{told} given; give one of {', '.join(choices)}, such as at: [5, 8]")
        if self.after is not None and self.node is None:
            raise ValueError("after goes with node; write node: carry beside it, or take it out")
        return self

    def drawn(self, rng: np.random.Generator) -> Self:
        """A copy in which each range is one value, drawn uniformly from it, twice."""
        spans = {name: getattr(self, name) for name in ("at", *self.SHARES, "after")}
        values = {name: float(rng.uniform(*span)) for name, span in spans.items() if span is not None}
        return self.model_copy(update={name: (value, value) for name, value in values.items()})


class Fault(Model):
    """Base of all faults."""

    type: str = Field(description="Which fault.", examples=["jaw_opens"])
    when: When = Field(description="When it begins.", examples=[{"at": [5.0, 8.0]}])


class Lasting(Fault):
    """A fault that may end before the run does."""

    seconds: Annotated[float, Field(gt=0, le=600)] | None = Field(
        default=None,
        description="How long it lasts, in seconds; without it, to the end of the run.",
        json_schema_extra=unit("s"),
        examples=[2.0],
    )


class JawFault(Lasting):
    """A fault of one arm's gripper."""

    arm: str = Field(default="right", description="Whose gripper.", examples=["right"])


class JawOpens(JawFault):
    """The gripper drives open, whatever it is commanded."""

    type: Literal["jaw_opens"] = Field(description="This fault.", examples=["jaw_opens"])
    seconds: Annotated[float, Field(gt=0, le=600)] | None = Field(
        default=1.0,
        description="How long it lasts, in seconds; null means to the end of the run.",
        json_schema_extra=unit("s"),
        examples=[1.0],
    )


class JawWeakens(JawFault):
    """The gripper presses with only a share of the force that it is commanded."""

    type: Literal["jaw_weakens"] = Field(description="This fault.", examples=["jaw_weakens"])
    force_share: Fraction = Field(description="Share of the force, 0 to 1.", examples=[0.05])


class JawStuck(JawFault):
    """The gripper keeps its last command and takes no new one, as with a broken bus."""

    type: Literal["jaw_stuck"] = Field(description="This fault.", examples=["jaw_stuck"])


class CameraFault(Lasting):
    """A fault of one camera."""

    camera: str = Field(description="Which camera.", examples=["rear"])


class CameraDrops(CameraFault):
    """Frames get lost, and none comes in their place. With a share of 1 the stream stops."""

    type: Literal["camera_drops"] = Field(description="This fault.", examples=["camera_drops"])
    share: PositiveFraction = Field(description="Share of the frames that get lost; each is drawn.", examples=[0.7])


class CameraFreezes(CameraFault):
    """The same picture is repeated with new stamps and numbers, as by a driver that reuses a buffer.

    For a stream whose stamps stop too, use `camera_drops` with a share of 1.
    """

    type: Literal["camera_freezes"] = Field(description="This fault.", examples=["camera_freezes"])


class CameraDark(CameraFault):
    """The lens is covered: 2 % of the light passes, and no depth is measured."""

    type: Literal["camera_dark"] = Field(description="This fault.", examples=["camera_dark"])


class CameraLosesDepth(CameraFault):
    """The depth image has no readings; the colour image is as before."""

    type: Literal["camera_loses_depth"] = Field(description="This fault.", examples=["camera_loses_depth"])


class LightChanges(Lasting):
    """The cell's light becomes brighter or darker, or comes from another direction."""

    type: Literal["light_changes"] = Field(description="This fault.", examples=["light_changes"])
    factor: Annotated[float, Field(ge=0.02, le=3)] = Field(
        default=1.0, description="Factor on the brightness.", examples=[0.5]
    )
    direction: Direction | None = Field(
        default=None,
        description="From the scene to the light, of any length; without it, as before.",
        examples=[[0.5, -1.0, 1.0]],
    )


class JointFault(Fault):
    """A fault of one joint."""

    arm: str = Field(description="Which arm.", examples=["right"])
    joint: str = Field(description="Which joint of it, by the name in its robot's file.", examples=["elbow"])


class JointStalls(JointFault, Lasting):
    """The joint's drive jams: the joint stays where it is, and its encoder goes on reading."""

    type: Literal["joint_stalls"] = Field(description="This fault.", examples=["joint_stalls"])


class JointLags(JointFault, Lasting):
    """The joint's drive is weak: it turns no faster than a share of its rated speed."""

    type: Literal["joint_lags"] = Field(description="This fault.", examples=["joint_lags"])
    speed_share: PositiveFraction = Field(description="Share of the rated speed.", examples=[0.15])


class EncoderJumps(JointFault):
    """The encoder slips on its shaft: its readings are off from then on. The drive's own sensor stays right."""

    type: Literal["encoder_jumps"] = Field(description="This fault.", examples=["encoder_jumps"])
    angle: Annotated[float, Field(ge=-3.2, le=3.2)] = Field(
        description="Radians (metres of a rail) by which its readings are too large from then on.",
        json_schema_extra=unit("rad"),
        examples=[0.3],
    )


class ObstacleMovesIn(Fault):
    """One of the scenario's obstacles slides along a line, with its stand. Contacts do not stop it."""

    type: Literal["obstacle_moves_in"] = Field(description="This fault.", examples=["obstacle_moves_in"])
    obstacle: str = Field(description="Name of one of the scenario's obstacles.", examples=["short"])
    by: Vector = Field(
        description="Displacement along x, y and z in metres.", json_schema_extra=unit("m"), examples=[[0.0, -0.5, 0.0]]
    )
    speed: Annotated[float, Field(gt=0, le=2)] = Field(
        default=0.25, description="Metres a second.", json_schema_extra=unit("m/s"), examples=[0.25]
    )


class ServiceFault(Lasting):
    """A fault of the robot's software; the world does not change."""

    calls: Annotated[int, Field(ge=1, le=1000)] | None = Field(
        default=None, description="Ends after so many calls, or when its seconds are over.", examples=[1]
    )


class ServiceRaises(ServiceFault):
    """A service that the leaves call raises an error."""

    type: Literal["service_raises"] = Field(description="This fault.", examples=["service_raises"])
    service: str = Field(description="The call that raises.", examples=["perception.look"])


class PlanningFindsNothing(ServiceFault):
    """The motion planner finds no path."""

    type: Literal["planning_finds_nothing"] = Field(description="This fault.", examples=["planning_finds_nothing"])


FAULTS: tuple[type[Fault], ...] = (
    JawOpens,
    JawWeakens,
    JawStuck,
    CameraDrops,
    CameraFreezes,
    CameraDark,
    CameraLosesDepth,
    LightChanges,
    JointStalls,
    JointLags,
    EncoderJumps,
    ObstacleMovesIn,
    ServiceRaises,
    PlanningFindsNothing,
)
