"""A run's record: result.json, events.jsonl and ticks.jsonl in one folder."""

import dataclasses
import io
import json
import logging
import math
import os
import platform
from collections.abc import Callable, MutableMapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self, TextIO

import structlog

from interfaces.cause import Cause, CauseCode

Outcome = Literal["stowed", "safe_stop", "time_limit", "interrupted", "internal_error"]

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
class Result:
    """What came out of a run; the fields of result.json in their order. Seconds and ratios are plain floats."""

    schema: int = dataclasses.field(default=1, init=False)
    scenario: str
    seed: int
    outcome: Outcome
    succeeded: bool
    case: str = "default"  # of the scenario's, where some of its values vary
    cause: Cause | None = None
    expectations: tuple[Expectation, ...] = ()
    slips: tuple[Slip, ...] = ()
    sim_seconds: float = 0.0
    wall_seconds: float = 0.0
    real_time_factor: float = 0.0
    renderer: str = ""
    versions: dict[str, str] = dataclasses.field(default_factory=versions)

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


def write_whole(path: Path, text: str) -> None:
    """Write a file in one step: readers see the old one or the new one, never a half.

    Raises:
        OSError: the file cannot be written.
    """
    part = path.with_name(path.name + ".part")
    with part.open("w", encoding="utf-8", newline="\n") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    part.replace(path)


class Record:
    """Context manager over a run's folder; with None as the folder all stays in memory.

    `ticks` is the stream for a `TickLog`. On leaving, the streams are closed and result.json is written: the one given
    to `finish`, or, where the run did not come so far, one that tells of the interrupt or the error.
    """

    def __init__(self, folder: Path | None, scenario: str, seed: int, case: str = "default") -> None:
        """Create the folder.

        Raises:
            FileExistsError: it holds a run already.
            OSError: it cannot be created or written.
        """
        self.folder = folder
        self.result: Result | None = None
        self._scenario = scenario
        self._seed = seed
        self._case = case
        self.events: TextIO = io.StringIO()
        self.ticks: TextIO = io.StringIO()
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            if taken := [name for name in ("result.json", "events.jsonl", "ticks.jsonl") if (folder / name).exists()]:
                raise FileExistsError(f"{folder} holds a run already ({', '.join(taken)})")
            self.events = (folder / "events.jsonl").open("x", encoding="utf-8", newline="\n")
            self.ticks = (folder / "ticks.jsonl").open("x", encoding="utf-8", newline="\n")

    def logger(self, now: Callable[[], float]) -> Any:
        """A structlog logger into events.jsonl; each line begins with `t`, the simulated second by `now`."""

        def stamp(_logger: Any, level: str, event: MutableMapping[str, Any]) -> dict[str, Any]:
            return {"t": round(now(), 6), "level": level, "event": event.pop("event", ""), **plain(dict(event))}

        return structlog.wrap_logger(
            structlog.WriteLogger(self.events),
            processors=[structlog.processors.format_exc_info, stamp, structlog.processors.JSONRenderer()],
            wrapper_class=structlog.make_filtering_bound_logger(logging.DEBUG),
        )

    def finish(self, result: Result) -> None:
        """The run's result, written when the record closes; a later one replaces it."""
        self.result = result

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if self.result is None:
                self.result = self._cut_short(error)
            if self.folder is not None:
                write_whole(self.folder / "result.json", self.result.to_json())
        finally:
            if self.folder is not None:
                self.events.close()
                self.ticks.close()

    def _cut_short(self, error: BaseException | None) -> Result:
        if isinstance(error, KeyboardInterrupt):
            cause = Cause(CauseCode.INTERRUPTED, "stopped from outside before the run could end")
            return Result(self._scenario, self._seed, "interrupted", succeeded=False, case=self._case, cause=cause)
        message = f"{type(error).__name__}: {error}" if error else "the run ended without a result"
        cause = Cause(CauseCode.INTERNAL_ERROR, message)
        return Result(self._scenario, self._seed, "internal_error", succeeded=False, case=self._case, cause=cause)
