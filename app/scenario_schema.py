"""What a scenario file may say, as pydantic models."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from app.fault_schema import FaultSpec
from interfaces.cause import CauseCode
from interfaces.cell import Color, Model, NotNegative, Vector
from interfaces.scene import Gravity

Outcome = Literal["stowed", "safe_stop"]
Edge = Annotated[float, Field(gt=0, le=3)]  # metres
Reach = Annotated[float, Field(ge=0, le=1)]  # metres


class ByGravity(Model):
    """A point (m, world frame) for each gravity: the loose end settles elsewhere when it hangs."""

    zero: Vector
    earth: Vector


class ObstacleSpec(Model):
    """A foam block that the robot is not told about; one that does not stand on the floor is held by a thin stand."""

    name: str
    size: tuple[Edge, Edge, Edge]  # along x, y, z before it is turned
    color: Color = (0.5, 0.2, 0.6)
    position: ByGravity  # centre in x and y, bottom in z
    yaw_deg: Annotated[float, Field(ge=-360, le=360)] = 0.0
    jitter: tuple[Reach, Reach, Reach] = (0.0, 0.0, 0.0)  # uniform, to both sides, drawn from the seed


class Limits(Model):
    """What ends a run that does not end by itself."""

    sim_seconds: Annotated[float, Field(gt=0, le=3600)] = 600.0
    tries: Annotated[int, Field(ge=1, le=20)] = 5  # deliveries, each after a recovery where the hand is empty


class Expect(Model):
    """What must come out; None is not looked at."""

    outcome: Outcome = "stowed"
    slips: Annotated[int, Field(ge=0, le=20)] | None = None  # real losses that were noticed
    hidden: bool | None = None  # settled out of the rear camera's sight and found by the wrist camera
    unintended_force: NotNegative | None = None  # newtons at most
    cause: CauseCode | None = None

    @model_validator(mode="after")
    def _cause_of_a_stop(self) -> Self:
        if self.cause is not None and self.outcome == "stowed":
            raise ValueError("a run that ends stowed has no cause; write outcome: safe_stop beside cause")
        return self


class ScenarioFile(Model):
    """A scenario file as written."""

    description: str
    cell: str  # a shipped cell's name, or a path from this file's folder
    tree: str  # likewise
    gravity: Gravity
    obstacles: tuple[ObstacleSpec, ...] = ()
    faults: tuple[FaultSpec, ...] = ()
    limits: Limits = Limits()
    expect: Expect = Expect()
