"""The result of a run: the fields of result.json (see RECORD.md beside this file)."""

import dataclasses
import json
import math
import platform
from importlib.metadata import PackageNotFoundError, version
from typing import Any, Literal

from regrasp.app.task.expectation import Expectation
from regrasp.interfaces.cause import Cause

Outcome = Literal["success", "failure", "time_limit", "wall_limit", "interrupted", "internal_error"]
NodeStatus = Literal["RUNNING", "SUCCESS", "FAILURE", "INVALID"]
DEFAULT_CASE = "default"  # name of the only case of a scenario that varies nothing
SCHEMA = 3  # version of result.json; fields may be added without a new version, but none changes its meaning

_PACKAGES = (
    "regrasp",
    "eaik",
    "moderngl",
    "numba",
    "numpy",
    "ompl",
    "opencv",
    "py_trees",
    "pybullet",
    "scipy",
    "toppra",
)
_DISTRIBUTIONS = {"opencv": "opencv-python-headless"}  # name in the package index, if it differs


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that can change a run; a package that is not installed is left out."""
    found = {"python": platform.python_version()}
    for name in _PACKAGES:
        try:
            found[name] = version(_DISTRIBUTIONS.get(name, name))
        except PackageNotFoundError:
            continue
    return found


@dataclasses.dataclass(frozen=True)
class Attempt:
    """An execution of a leaf, in simulated seconds; INVALID: it was stopped.

    Executions in consecutive ticks that each ended at once and alike are one attempt with `times` > 1.
    """

    path: str
    started: float
    ended: float
    status: NodeStatus
    cause: Cause | None = None
    times: int = 1


@dataclasses.dataclass(frozen=True)
class Link:
    """A node of the chain from the root down to the leaf that decided the outcome: when and why it ended so."""

    path: str
    type: str
    at: float
    why: str


@dataclasses.dataclass(frozen=True)
class Result:
    """The result of a run: the fields of result.json in their order."""

    schema: int = dataclasses.field(default=SCHEMA, init=False)
    scenario: str
    seed: int
    outcome: Outcome
    succeeded: bool
    task: str = ""
    case: str = DEFAULT_CASE  # which of the scenario's cases, if its values vary
    cause: Cause | None = None
    chain: tuple[Link, ...] | None = None  # None if the run ended in success, or in no node
    traceback: str | None = None  # of an internal_error
    expectations: tuple[Expectation, ...] = ()
    measured: dict[str, Any] = dataclasses.field(default_factory=dict)  # by the task's judge
    sim_seconds: float = 0.0
    wall_seconds: float = 0.0
    real_time_factor: float = 0.0
    wall_by_part: dict[str, float] = dataclasses.field(default_factory=dict)  # s, see `regrasp.interfaces.wall_time`
    longest_tick: float = 0.0  # s of wall time from one tick of the tree to the next
    renderer: str = ""
    versions: dict[str, str] = dataclasses.field(default_factory=versions)
    belief: dict[str, Any] | None = None  # what the robot knew at the end, no ground truth; the task says what
    attempts: tuple[Attempt, ...] = ()
    # Of a scene that the seed drew: how often what was thrown away before it, by reason.
    thrown_away: dict[str, dict[str, int]] | None = None

    def values(self) -> dict[str, Any]:
        """What result.json holds, before it is written; `thrown_away` only of a scene that the seed drew."""
        values = dataclasses.asdict(self)
        if self.thrown_away is None:
            del values["thrown_away"]
        return values

    def to_json(self) -> str:
        """The text of result.json; inf and nan, which JSON cannot state, become null."""
        return json.dumps(plain(self.values()), indent=2, allow_nan=False) + "\n"


def plain(value: Any) -> Any:
    """The value in JSON's own types: tuples and arrays as lists, numpy scalars as numbers, inf and nan as None."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, (bool, int, str)) else str(value)
