"""A run's record: a folder of result.json, events.jsonl, ticks.jsonl and what was run; see app/RECORD.md."""

import dataclasses
import errno
import io
import json
import logging
import math
import os
import platform
import traceback
from collections.abc import Callable, Mapping, MutableMapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Literal, Self, TextIO

import structlog

from regrasp.app import output
from regrasp.app.findings import Findings, real
from regrasp.app.interrupts import WallLimit, held_back
from regrasp.interfaces.cause import Cause, CauseCode

Outcome = Literal["stowed", "safe_stop", "time_limit", "wall_limit", "interrupted", "internal_error"]
NodeStatus = Literal["RUNNING", "SUCCESS", "FAILURE", "INVALID"]
SCHEMA = 1  # of result.json; fields may be added to it, none changes its meaning
MOST_AT_WORK = 1 << 16  # bytes of it
AT_WORK = "at_work.json"  # while a run goes on: which leaf is in the middle of a tick

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
_DISTRIBUTIONS = {"opencv": "opencv-python-headless"}  # where the package index has another name


def versions() -> dict[str, str]:
    """Version of Python and of the packages that bear on a run's course; those that are not installed are left out."""
    found = {"python": platform.python_version()}
    for name in _PACKAGES:
        try:
            found[name] = version(_DISTRIBUTIONS.get(name, name))
        except PackageNotFoundError:
            continue
    return found


@dataclasses.dataclass(frozen=True)
class Expectation:
    """One expectation of the scenario: what came out and what was asked."""

    name: str
    met: bool
    value: Any
    limit: Any


@dataclasses.dataclass(frozen=True)
class Slip:
    """One loss of the connector, in simulated seconds; None where it was not noticed."""

    released_at: float
    detected_at: float | None
    detected_by: str | None


@dataclasses.dataclass(frozen=True)
class Attempt:
    """One execution of a leaf, in simulated seconds; INVALID: it was stopped. What ended alike tick by tick is one."""

    path: str
    started: float
    ended: float
    status: NodeStatus
    cause: Cause | None = None
    times: int = 1


@dataclasses.dataclass(frozen=True)
class Link:
    """One node of the chain from the root down to the leaf that decided the outcome: what became of it, and when."""

    path: str
    type: str
    at: float
    why: str


@dataclasses.dataclass(frozen=True)
class Pose:
    """Metres, and x, y, z, w."""

    position: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]


@dataclasses.dataclass(frozen=True)
class Sighting:
    """Where (m, world) and when (simulated s) a camera saw the connector."""

    at: float
    camera: str
    position: tuple[float, float, float]


@dataclasses.dataclass(frozen=True)
class ArmState:
    """Joints (rad) as read, and world_from_tool by them."""

    joints: tuple[float, ...]
    tool: Pose


@dataclasses.dataclass(frozen=True)
class BeliefState:
    """The world as the robot knew it at the end; no ground truth."""

    held: Pose | None  # tool_from_connector of the right hand
    connector: Pose | None  # world_from_connector as last found for a grasp
    sure: bool  # whether the whole of it was seen there
    found_by: str | None
    last_seen: Sighting | None
    arms: dict[str, ArmState]
    occupied_voxels: int  # of the obstacles that it mapped
    vain_searches: int  # since the connector was found last
    notices: tuple[tuple[float, str], ...]  # losses that it noticed: when (simulated s), by which test


@dataclasses.dataclass(frozen=True)
class Result:
    """What came out of a run; the fields of result.json in their order. Seconds and ratios are plain floats."""

    schema: int = dataclasses.field(default=SCHEMA, init=False)
    scenario: str
    seed: int
    outcome: Outcome
    succeeded: bool
    case: str = "default"  # of the scenario's, where some of its values vary
    cause: Cause | None = None
    chain: tuple[Link, ...] | None = None  # None where the run ended stowed, or in no node
    traceback: str | None = None  # of an internal_error
    expectations: tuple[Expectation, ...] = ()
    slips: tuple[Slip, ...] = ()
    sim_seconds: float = 0.0
    wall_seconds: float = 0.0
    real_time_factor: float = 0.0
    renderer: str = ""
    versions: dict[str, str] = dataclasses.field(default_factory=versions)
    belief: BeliefState | None = None
    attempts: tuple[Attempt, ...] = ()

    def to_json(self) -> str:
        """The text of result.json; numbers that JSON has no word for (inf, nan) become null."""
        return json.dumps(plain(dataclasses.asdict(self)), indent=2, allow_nan=False) + "\n"


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


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file in one step: readers see the old one or the new one, never a half.

    What a link names is written, not the link; a pipe or a device takes the content as it comes.

    Raises:
        OSError: the file cannot be written.
    """
    data = content.encode() if isinstance(content, str) else content
    if path.exists() and not path.is_file():
        path.write_bytes(data)
        return
    path = real(path)
    if path.is_symlink():  # it leads back to itself
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path))
    part = path.with_name(path.name + ".part")
    try:
        with part.open("wb") as file:
            if path.exists():
                os.fchmod(file.fileno(), path.stat().st_mode)
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


class Record:
    """Context manager over a run's folder; with None as the folder all stays in memory.

    `ticks` is the stream for a `TickLog`. On leaving, the streams are closed and result.json is written: the one given
    to `finish`, or, where the run did not come so far, one that tells of the interrupt or the error.
    """

    def __init__(
        self,
        folder: Path | None,
        scenario: str,
        seed: int,
        case: str = "default",
        copies: Mapping[str, str] | None = None,
    ) -> None:
        """Create the folder, with `copies` (name to text) of what is run.

        Raises:
            Findings: it holds a run already, or cannot be written.
            OSError: it cannot be created or written.
        """
        self.folder = folder
        self.result: Result | None = None
        self._scenario = scenario
        self._seed = seed
        self._case = case
        self.events: TextIO = io.StringIO()
        self.ticks: TextIO = io.StringIO()
        self._at_work: BinaryIO = io.BytesIO()
        self._longest = 0
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            if found := output.findings(folder):
                raise Findings(found)
            try:
                self.events = (folder / "events.jsonl").open("x", encoding="utf-8", newline="\n")
            except FileExistsError:  # another run took the folder this very moment
                raise Findings(output.holds_a_run(folder)) from None
            self._at_work = (folder / AT_WORK).open("wb", buffering=0)
            self.at_work(0.0, "")
            self.ticks = (folder / "ticks.jsonl").open("x", encoding="utf-8", newline="\n")
            for name, text in (copies or {}).items():
                (folder / name).write_text(text, encoding="utf-8", newline="\n")

    def logger(self, now: Callable[[], float], on_event: Callable[[Mapping[str, Any]], None] | None = None) -> Any:
        """A structlog logger into events.jsonl; each line begins with `t`, the simulated second by `now`.

        `on_event` is called with each event's values, too.
        """

        def stamp(_logger: Any, level: str, event: MutableMapping[str, Any]) -> dict[str, Any]:
            values = {"t": round(now(), 6), "level": level, "event": event.pop("event", ""), **plain(dict(event))}
            if on_event is not None:
                on_event(values)
            return values

        return structlog.wrap_logger(
            structlog.WriteLogger(self.events),
            processors=[structlog.processors.format_exc_info, stamp, structlog.processors.JSONRenderer()],
            wrapper_class=structlog.make_filtering_bound_logger(logging.DEBUG),
        )

    def at_work(self, t: float, node: str) -> None:
        """Note that a leaf begins its tick at second `t`, or, with "" for its path, that the tick has ended.

        Should the process die or hang in the middle of it, this is all that names the leaf.
        """
        line = json.dumps({"t": round(t, 6), "node": node}).ljust(self._longest)
        self._longest = len(line)  # a shorter line leaves nothing of a longer one, in a single write
        self._at_work.seek(0)
        self._at_work.write(line.encode() + b"\n")

    def finish(self, result: Result) -> None:
        """The run's result, written when the record closes; a later one replaces it."""
        self.result = result

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with held_back():
            if self.result is None:
                self.result = self._cut_short(error)
            if self.folder is not None:
                self.events.close()
                self.ticks.close()
                self._at_work.close()
                write_whole(self.folder / "result.json", self.result.to_json())
                (self.folder / AT_WORK).unlink(missing_ok=True)

    def _cut_short(self, error: BaseException | None) -> Result:
        if isinstance(error, KeyboardInterrupt):
            code = CauseCode.WALL_LIMIT if isinstance(error, WallLimit) else CauseCode.INTERRUPTED
            cause = Cause(code, "stopped from outside before the run could end")
            outcome: Outcome = "wall_limit" if isinstance(error, WallLimit) else "interrupted"
            return Result(self._scenario, self._seed, outcome, succeeded=False, case=self._case, cause=cause)
        message = f"{type(error).__name__}: {error}" if error else "the run ended without a result"
        cause = Cause(CauseCode.INTERNAL_ERROR, message)
        trace = "".join(traceback.format_exception(error)) if error else None
        return Result(
            self._scenario,
            self._seed,
            "internal_error",
            succeeded=False,
            case=self._case,
            cause=cause,
            traceback=trace,
        )


def finish_killed(folder: Path, run: Result) -> Result:
    """The result `run` of a run whose process is gone, with the leaf that was at work; written where there is none.

    Nothing is written where the folder holds no run.
    """
    if run.cause is not None and (leaf := leaf_at_work(folder)):
        run = dataclasses.replace(run, cause=dataclasses.replace(run.cause, node=leaf[1]), sim_seconds=leaf[0])
    if (folder / "events.jsonl").is_file() and not os.path.lexists(folder / "result.json"):
        with held_back():
            write_whole(folder / "result.json", run.to_json())
            (folder / AT_WORK).unlink(missing_ok=True)
    return run


def leaf_at_work(folder: Path) -> tuple[float, str] | None:
    """The second (simulated) and the path of the leaf in whose tick a run was killed, or hangs; None: in none."""
    try:
        noted = json.loads((folder / AT_WORK).read_bytes()[:MOST_AT_WORK])
        t, node = float(noted["t"]), noted["node"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return (t, node) if isinstance(node, str) and node and math.isfinite(t) else None
