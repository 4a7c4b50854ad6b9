"""Reads and checks a run's folder. The fields of its files: app/records/RECORD.md."""

import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, Field, TypeAdapter, ValidationError
from pydantic_core import from_json

from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.records import folders
from regrasp.app.records.record import leaf_at_work
from regrasp.app.records.result import SCHEMA, NodeStatus, Result
from regrasp.app.records.signals import FILE as SIGNALS
from regrasp.app.records.signals import Signals, read_signals
from regrasp.app.task import find
from regrasp.trees.wiring import MAX_TREE_DEPTH

MAX_RESULT_BYTES, MAX_LINES_BYTES = 16 << 20, 64 << 20  # bytes of result.json, of each of the others: hours of a run
MAX_FINDINGS = 10  # of one file
TOO_DEEP = f"a path with more than {MAX_TREE_DEPTH} steps, which no tree has"
T = TypeVar("T")
SimSeconds = Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False)]


def _path(path: str) -> str:
    """The path, if a tree may have such a node. Raises ValueError."""
    if path.count("/") > MAX_TREE_DEPTH:
        raise ValueError(TOO_DEEP)
    return path


NodePath = Annotated[str, AfterValidator(_path)]


@dataclass(frozen=True, slots=True)
class Tick:
    """A node's status changed: when (simulated s), which node, to what."""

    t: SimSeconds
    path: NodePath
    status: NodeStatus


@dataclass(frozen=True, slots=True)
class Event:
    """A line of events.jsonl: when (simulated s), which event, of which node ('' for none), and its other values."""

    t: SimSeconds
    event: str
    node: str
    values: dict[str, Any]
    level: str = ""


@dataclass(frozen=True)
class RunRecord:
    """A run's folder. `remarks` are sentences about what is missing in it."""

    folder: Path
    result: Result | None  # None: the run was killed, or goes on
    events: tuple[Event, ...]
    ticks: tuple[Tick, ...]
    remarks: tuple[str, ...] = ()
    at_work: tuple[float, str] | None = None  # second, and path of the leaf in whose tick the run was killed, or is now

    @property
    def end(self) -> float:
        """The last simulated second in the record."""
        lines = (self.ticks[-1:], self.events[-1:])
        return max([line.t for last in lines for line in last] + [self.at_work[0] if self.at_work else 0.0])

    def signals(self) -> Signals | None:
        """Joints, poses, forces and estimates at each tick; None if there are none. Raises `Findings`."""
        path = self.folder / SIGNALS
        return read_signals(path) if os.path.lexists(path) else None

    @property
    def begin(self) -> dict[str, Any]:
        """The values of the `begin` event: what was run; {} if it is missing."""
        return next((e.values for e in self.events if e.event == "begin"), {})


def read_record(folder: Path) -> RunRecord:
    """Read and check a run's folder.

    A run that was killed has no result, and its last lines may be incomplete: those are remarks. Raises `Findings` for
    a folder without a run, for invalid files, and for a result that is newer than this program.
    """
    record, found = read_sound_part(folder)
    if found:
        raise Findings(found)
    return record


def read_sound_part(folder: Path) -> tuple[RunRecord, list[Finding]]:
    """What can be read of a run's folder, and what is wrong in it; wrong lines, or a wrong result, are left out.

    Raises `Findings` for a folder without a run, and for a result that is newer than this program.
    """
    if not os.path.isdir(folder):
        wrong = "is no folder" if os.path.lexists(folder) else "does not exist"
        raise Findings([Finding(shown(folder), 0, f"{wrong}; name a folder that regrasp run made")])
    if not any(os.path.lexists(folder / name) for name in folders.FILES[:3]):
        raise Findings([Finding(shown(folder), 0, "holds no run; name a folder that regrasp run made")])
    found: list[Finding] = []
    remarks: list[str] = []
    events = _lines(folder / "events.jsonl", _event, found, remarks)
    ticks = _lines(folder / "ticks.jsonl", _adapter(Tick).validate_python, found, remarks)
    result = None
    if os.path.lexists(folder / "result.json"):
        result = _result(folder / "result.json", found)
    else:
        ended = any(event.event == "end" for event in events)
        why = "it is lost, for the run ended" if ended else "the run was killed, or still goes on"
        remarks.append(f"there is no result.json: {why}")
    at_work = None if result else leaf_at_work(folder)
    return RunRecord(folder, result, tuple(events), tuple(ticks), tuple(remarks), at_work), found


@cache
def _adapter(kind: type[T]) -> TypeAdapter[T]:
    return TypeAdapter(kind)


@dataclass(frozen=True)
class _EventHead:
    t: SimSeconds
    event: str
    node: NodePath = ""
    level: str = ""


def _event(value: dict[str, Any]) -> Event:
    head = _adapter(_EventHead).validate_python(value)
    rest = {name: item for name, item in value.items() if name not in ("t", "level", "event", "node")}
    return Event(head.t, head.event, head.node, rest, head.level)


def _lines(path: Path, make: Callable[[dict[str, Any]], T], found: list[Finding], remarks: list[str]) -> list[T]:
    """The value of each line; errors are added to `found`, and to `remarks` that the last line is incomplete."""
    data = _bytes(path, MAX_LINES_BYTES, found)
    if data is None:
        return []
    *whole, last = data.split(b"\n")
    values: list[T] = []
    before, wrong = 0.0, 0
    for number, line in enumerate([*whole, last] if last else whole, 1):
        try:
            value = make(_object(line))
            stamp = value.t  # type: ignore[attr-defined]
            if stamp < before:
                raise ValueError(f"t goes back from {before:g} to {stamp:g}; lines are in the order of time")
            before = stamp
            values.append(value)
        except ValueError as error:
            if number > len(whole):
                remarks.append(f"the last line of {path.name} is half written: the run was killed, or still goes on")
                break
            wrong += 1
            found.append(Finding(shown(path), number, _sentence(error)))
            if wrong == MAX_FINDINGS:
                break
    return values


def _result(path: Path, found: list[Finding]) -> Result | None:
    data = _bytes(path, MAX_RESULT_BYTES, found)
    if data is None:
        return None
    try:
        value = _object(data)
        schema = value.pop("schema", None)
        if not isinstance(schema, int) or schema < 1:
            raise ValueError(f"no 'schema' with a number; a result.json that this program reads has {SCHEMA}")
        if schema > SCHEMA:  # what its fields mean is not known
            message = f"schema {schema} is newer than {SCHEMA}, which this program reads; take a newer Regrasp"
            raise Findings([Finding(shown(path), 1, message)])
        if schema < SCHEMA:
            _translate(value)
        result = _adapter(Result).validate_python(value)
        for number, attempt in enumerate(result.attempts):
            if attempt.path.count("/") > MAX_TREE_DEPTH:
                raise ValueError(f"attempts.{number}.path: {TOO_DEEP}; a run writes shorter ones")
        return result
    except ValueError as error:
        at = re.search(r" at line (\d+) column", str(error))
        found.append(Finding(shown(path), int(at[1]) if at else 1, _sentence(error)))
        return None


def _translate(value: dict[str, Any]) -> None:
    """Put today's words in a result of schema 1 or 2, from before there were several tasks."""
    old = find.old_outcomes()
    value["task"] = find.of_old_records()
    value["measured"] = {"slips": value.pop("slips", [])}
    value["outcome"] = old.get(str(value.get("outcome")), value.get("outcome"))
    expectations = value.get("expectations")
    for item in expectations if isinstance(expectations, list) else ():
        if isinstance(item, dict) and item.get("name") == "outcome":
            for key in ("value", "limit"):
                item[key] = old.get(str(item.get(key)), item.get(key))


def _bytes(path: Path, most: int, found: list[Finding]) -> bytes | None:
    """The file's bytes; None, with a finding added, if it cannot be read or is too long."""
    if not os.path.isfile(path):  # a pipe or a device would not end
        wrong = "is no file" if os.path.lexists(path) else "is missing"
        found.append(Finding(shown(path), 0, f"{wrong}; a run leaves one"))
        return None
    try:
        with path.open("rb") as stream:
            data = stream.read(most + 1)
    except OSError as error:
        found.append(Finding(shown(path), 0, f"cannot be read: {error.strerror}"))
        return None
    if len(data) > most:
        found.append(Finding(shown(path), 0, f"longer than {most >> 20} MiB; no run leaves that much"))
        return None
    return data


def _object(text: bytes) -> dict[str, Any]:
    """Parse a JSON object. Raises ValueError for anything else: NaN, nesting beyond 200, text that is not UTF-8."""
    try:
        value = from_json(text, allow_inf_nan=False)
    except ValueError as error:
        raise ValueError(f"not JSON: {error}; a run writes {{...}}") from None
    if not isinstance(value, dict):
        raise ValueError("no JSON object; a run writes {...}")
    return value


def _sentence(error: ValueError) -> str:
    """What is wrong, in one sentence: the first error of a model."""
    if not isinstance(error, ValidationError):
        return str(error)
    first = error.errors(include_url=False, include_input=False)[0]
    where = ".".join(str(step) for step in first["loc"])
    return f"{where}: {first['msg']}; a run writes it otherwise, so the file was changed"
