"""Scenario files as pydantic models: each field with its meaning, its unit and an example."""

from typing import Annotated, Any, get_args

from pydantic import AfterValidator, Field, JsonValue

from regrasp.app.tasks.cable.expectations import Expect
from regrasp.interfaces.fault import AnyFault
from regrasp.interfaces.fields import Color, Direction, Fraction, Model, Vector
from regrasp.interfaces.scene import Gravity
from regrasp.interfaces.seed import MAX_SEED

FaultSpec = Annotated[AnyFault, Field(discriminator="type")]
FAULT_TYPES: dict[str, type] = {get_args(f.model_fields["type"].annotation)[0]: f for f in get_args(AnyFault)}
Edge = Annotated[float, Field(ge=1e-3, le=3)]  # metres
ObstacleSize = tuple[Edge, Edge, Edge]
Reach = Annotated[float, Field(ge=0, le=1)]  # metres
Jitter = tuple[Reach, Reach, Reach]
Yaw = Annotated[float, Field(ge=-360, le=360)]


def _in_order(text: str) -> str:
    first, after = map(int, text.split(":"))
    if first >= after:
        raise ValueError(f"{text!r} holds no number; write A:B with A below B, such as '0:5'")
    return text


class Steps(Model):
    """Evenly spaced numbers."""

    first: Annotated[float, Field(alias="from", allow_inf_nan=False, description="The first number.", examples=[0.1])]
    last: Annotated[float, Field(alias="to", allow_inf_nan=False, description="The last number.", examples=[0.5])]
    steps: Annotated[int, Field(ge=2, le=10_000, description="How many numbers, both ends among them.", examples=[5])]


Listed = Annotated[tuple[JsonValue, ...], Field(min_length=1)]
WholeNumbers = Annotated[str, Field(pattern=r"^[0-9]{1,10}:[0-9]{1,10}$", examples=["0:5"]), AfterValidator(_in_order)]
Vary = dict[str, Listed | WholeNumbers | Steps]


class ByGravity(Model):
    """A point for each gravity: the loose end settles elsewhere when it hangs."""

    zero: Annotated[Vector, Field(description="Without gravity: x, y, z in metres.", examples=[[0.22, 0.12, 0.1]])]
    earth: Annotated[Vector, Field(description="Under Earth's gravity, likewise.", examples=[[0.22, 0.11, 0.0]])]


class ObstacleSpec(Model):
    """A foam block that the robot is not told about; one that does not stand on the floor is held by a thin stand."""

    name: Annotated[str, Field(description="What messages and records call it.", examples=["short"])]
    size: Annotated[
        ObstacleSize,
        Field(description="Edges along x, y, z before it is turned, in metres.", examples=[[0.08, 0.12, 0.18]]),
    ]
    color: Annotated[Color, Field(description="Red, green, blue, each 0 to 1.", examples=[[0.45, 0.2, 0.6]])] = (
        0.5,
        0.2,
        0.6,
    )
    position: Annotated[
        Vector | ByGravity,
        Field(
            description="Its centre in x and y and its bottom in z, metres in the world's frame; one for each gravity "
            "where they differ.",
            examples=[[0.22, 0.12, 0.1], {"zero": [0.22, 0.12, 0.1], "earth": [0.22, 0.11, 0.0]}],
        ),
    ]
    yaw_deg: Annotated[Yaw, Field(description="Turned left by so many degrees.", examples=[30])] = 0.0
    jitter: Annotated[
        Jitter,
        Field(
            description="The seed moves it by up to so many metres along x, y, z, to both sides, uniformly.",
            examples=[[0.004, 0.006, 0.0]],
        ),
    ] = (0.0, 0.0, 0.0)

    def position_in(self, gravity: Gravity) -> Vector:
        """Its position without jitter (m) in this gravity."""
        if not isinstance(self.position, ByGravity):
            return self.position
        return self.position.zero if gravity == "zero" else self.position.earth


class LightSpec(Model):
    """The light in place of the cell's; what is left out stays, and the seed's own variation comes on top."""

    brightness: Annotated[
        float, Field(ge=0, le=3, description="Factor on the ambient and the far light.", examples=[0.5])
    ] = 1.0
    direction: Annotated[
        Direction | None,
        Field(description="From the scene to the far light; the length does not matter.", examples=[[-0.5, 0.3, 1.0]]),
    ] = None
    ambient: Annotated[
        Fraction | None, Field(description="Strength of the light from all sides, 0 to 1.", examples=[0.45])
    ] = None
    diffuse: Annotated[
        Fraction | None, Field(description="Strength of the far light that throws shadows, 0 to 1.", examples=[0.55])
    ] = None


class Limits(Model):
    """What ends a run that does not end by itself."""

    sim_seconds: Annotated[
        float, Field(gt=0, le=3600, description="Simulated seconds, then the run is cut short.", examples=[120.0])
    ] = 600.0


TreeInput = bool | int | float | Annotated[str, Field(pattern=r"^[^{}]*$", examples=["rear"])]
Marker = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$", examples=["slow"])]


class ScenarioFile(Model):
    """A scenario: which cell, which tree, what goes wrong, and what must come out."""

    description: Annotated[str, Field(description="A sentence for the list.", examples=["The end is lost in sight."])]
    cell: Annotated[
        str,
        Field(
            description="A shipped cell's name, or a path from this file's folder (with --set, from the current one).",
            examples=["thesis"],
        ),
    ]
    tree: Annotated[
        str,
        Field(
            description="A shipped tree's name, or a path from this file's folder (with --set, from the current one).",
            examples=["recovery"],
        ),
    ]
    inputs: Annotated[
        dict[str, TreeInput],
        Field(
            description="Values in place of the defaults of the main tree's keys.",
            examples=[{"tries": 3}],
        ),
    ] = Field(default_factory=dict)
    gravity: Annotated[Gravity, Field(description="None, or Earth's.", examples=["zero"])]
    seed: Annotated[int, Field(ge=0, le=MAX_SEED, description="Draws every error, noise and jitter.", examples=[7])] = 0
    obstacles: Annotated[
        tuple[ObstacleSpec, ...],
        Field(
            description="Foam blocks that the robot is not told about.",
            examples=[[{"name": "a", "size": [0.1, 0.1, 0.2], "position": [0, 0, 0]}]],
        ),
    ] = ()
    light: Annotated[
        LightSpec, Field(description="The light in place of the cell's.", examples=[{"brightness": 0.5}])
    ] = LightSpec()
    faults: Annotated[
        tuple[FaultSpec, ...],
        Field(
            description="What the world does to the robot.",
            examples=[[{"type": "jaw_opens", "when": {"carried": [0.2, 0.65]}}]],
        ),
    ] = ()
    limits: Annotated[Limits, Field(description="When a run is cut short.", examples=[{"sim_seconds": 120.0}])] = (
        Limits()
    )
    expect: Annotated[
        Expect,
        Field(
            description="What must come out, by ground truth; left out: success, with the connector stowed.",
            examples=[{"outcome": "failure", "cause": "search_exhausted"}],
        ),
    ] = Expect()
    markers: Annotated[
        tuple[Marker, ...], Field(description="pytest's markers for the cases.", examples=[["slow"]])
    ] = ()
    vary: Annotated[
        Vary,
        Field(
            description=(
                "Dotted keys of this file, or with cell. of the cell, each with a list of values, whole numbers 'A:B' "
                "(B left out) or evenly spaced numbers. Every combination is a case; the first values make the default."
                " The file must be right without them, too; only keys at its top may stand here alone."
            ),
            examples=[
                {
                    "gravity": ["zero", "earth"],
                    "seed": "0:5",
                    "light.brightness": {"from": 0.5, "to": 1.0, "steps": 3},
                }
            ],
        ),
    ] = Field(default_factory=dict)


def json_schema() -> dict[str, Any]:
    """The schema of scenario files as JSON Schema, draft 2020-12."""
    schema = ScenarioFile.model_json_schema()
    required = [{"required": [key]} for key in schema.pop("required")]
    varied = [{"required": ["vary"], "properties": {"vary": key}} for key in required]
    either = [{"anyOf": [here, there]} for here, there in zip(required, varied, strict=True)]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "allOf": either}
