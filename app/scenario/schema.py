"""Scenario files as pydantic models: each field with its meaning, its unit and an example. Each task has its own."""

from copy import copy
from enum import StrEnum
from functools import cache, reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, get_args

from pydantic import AfterValidator, Field, JsonValue, create_model
from pydantic.fields import FieldInfo

from regrasp.app.task.draw import Draw
from regrasp.app.task.expect import Expect
from regrasp.app.task.find import task_named
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.fault import FAULTS, Fault, ServiceRaises
from regrasp.interfaces.fields import Color, Direction, Fraction, Model, Vector
from regrasp.interfaces.scene import Gravity
from regrasp.interfaces.seed import MAX_SEED

if TYPE_CHECKING:
    from regrasp.app.task.task import Task

SERVICE_CALLS = ("perception.map_obstacles", "motion.move", "motion.straight", "motion.shift")  # of every task
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

    TASK: ClassVar[str] = ""  # of the model of a task's files

    description: Annotated[str, Field(description="A sentence for the list.", examples=["The end is lost in sight."])]
    cell: Annotated[
        str,
        Field(
            description="A shipped cell's name, or a path from this file's folder (with --set, from the current one).",
            examples=["thesis"],
        ),
    ]
    task: Annotated[
        str | None,
        Field(description="The job; left out: the one whose section the cell holds.", examples=["button"]),
    ] = None
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
    draw: Annotated[
        Draw | None,
        Field(
            description="What the seed draws besides; a scene that cannot be solved is thrown away.",
            examples=[{"light": {"brightness": [0.6, 1.3]}}],
        ),
    ] = None
    light: Annotated[
        LightSpec, Field(description="The light in place of the cell's.", examples=[{"brightness": 0.5}])
    ] = LightSpec()
    faults: Annotated[
        tuple[Fault, ...],
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
            description="What must come out, by ground truth; left out: success.",
            examples=[{"outcome": "failure", "cause": "planning_failed"}],
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

    def __reduce__(self) -> Any:
        """Pickle by the task's name: its model is made at run time."""
        return _restored, (self.TASK, self.model_dump_json(by_alias=True))


@cache
def unknown_task_model() -> type[ScenarioFile]:
    """The model of files whose task is not known yet: any faults and expectations."""
    fields: dict[str, Any] = {
        "draw": (dict[str, Any] | None, ScenarioFile.model_fields["draw"]),
        "faults": (tuple[Any, ...], ScenarioFile.model_fields["faults"]),
        "expect": (dict[str, Any], _with_default(ScenarioFile.model_fields["expect"], {})),
    }
    model: Any = create_model("ScenarioFile", __base__=ScenarioFile, __doc__=ScenarioFile.__doc__ or "", **fields)
    made: type[ScenarioFile] = model
    return made


@cache
def scenario_model(task: "Task") -> type[ScenarioFile]:
    """The model of the task's scenario files: with its faults, what they may wait for, its causes and expectations."""
    faults = tuple(_for_task(fault, task) for fault in (*FAULTS, *task.faults()))
    spec = Annotated[reduce(or_, faults), Field(discriminator="type")]  # type: ignore[valid-type]
    causes = StrEnum("CauseCode", {code.name: code.value for code in (*CauseCode, *task.causes())})  # type: ignore[misc]
    base = task.expect()
    expect: Any = create_model(
        "Expect",
        __base__=base,
        __doc__=base.__doc__,
        __module__=base.__module__,
        cause=(causes | None, base.model_fields["cause"]),
    )
    expect.OLD_OUTCOMES = task.old_outcomes
    name = copy(ScenarioFile.model_fields["task"])
    name.examples = [task.name]
    fields: dict[str, Any] = {
        "task": (str | None, name),
        "draw": (task.draw() | None, ScenarioFile.model_fields["draw"]),
        "faults": (tuple[spec, ...], ScenarioFile.model_fields["faults"]),  # type: ignore[valid-type]
        "expect": (expect, _with_default(ScenarioFile.model_fields["expect"], expect())),
    }
    model: Any = create_model("ScenarioFile", __base__=ScenarioFile, __doc__=ScenarioFile.__doc__ or "", **fields)
    made: type[ScenarioFile] = model
    made.TASK = task.name
    return made


def _restored(task: str, text: str) -> ScenarioFile:
    """A pickled scenario file of that task."""
    return scenario_model(task_named(task)).model_validate_json(text, strict=True)


def fault_types(task: "Task") -> dict[str, type[Fault]]:
    """The faults of a task's scenarios, those of every task among them, by their names in a file."""
    faults = (_for_task(fault, task) for fault in (*FAULTS, *task.faults()))
    return {get_args(fault.model_fields["type"].annotation)[0]: fault for fault in faults}


@cache
def _for_task(fault: type[Fault], task: "Task") -> type[Fault]:
    """The fault's model, with what the task's faults may wait for, and the services that it has."""
    base = task.when()
    when = create_model("When", __base__=base, __doc__=base.__doc__, __module__=base.__module__)
    fields: dict[str, Any] = {"when": (when, fault.model_fields["when"])}
    if issubclass(fault, ServiceRaises):
        calls = Literal[(*task.service_calls, *SERVICE_CALLS)]  # type: ignore[valid-type]
        fields["service"] = (calls, fault.model_fields["service"])
    model: Any = create_model(
        fault.__name__, __base__=fault, __doc__=fault.__doc__, __module__=fault.__module__, **fields
    )
    made: type[Fault] = model
    return made


def _with_default(info: FieldInfo, default: Any) -> FieldInfo:
    changed = copy(info)
    changed.default = default
    return changed


def json_schema(task: "Task") -> dict[str, Any]:
    """The schema of the task's scenario files as JSON Schema, draft 2020-12."""
    schema = scenario_model(task).model_json_schema()
    required = [{"required": [key]} for key in schema.pop("required")]
    varied = [{"required": ["vary"], "properties": {"vary": key}} for key in required]
    either = [{"anyOf": [here, there]} for here, there in zip(required, varied, strict=True)]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "allOf": either}
