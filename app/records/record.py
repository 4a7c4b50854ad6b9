"""A run's record: a folder of result.json, events.jsonl, ticks.jsonl and what was run; see app/records/RECORD.md."""

import dataclasses
import io
import json
import logging
import math
import os
import traceback
from collections.abc import Callable, Mapping, MutableMapping
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self, TextIO

import structlog

from regrasp.app.files.findings import Findings
from regrasp.app.files.whole_file import write_whole
from regrasp.app.interrupts import WallLimit, signals_deferred
from regrasp.app.records import folders, signals
from regrasp.app.records.result import DEFAULT_CASE, Outcome, Result, plain
from regrasp.interfaces.cause import Cause, CauseCode

MAX_AT_WORK_BYTES = 1 << 16  # bytes of it
AT_WORK = "at_work.json"  # exists while a run goes on: which leaf is in the middle of a tick


Progress = Callable[[float, str], None]  # simulated seconds, active leaf; called at each tick
OnEvent = Callable[[Mapping[str, Any]], None]  # called with each event as events.jsonl has it


class Record:
    """Context manager that writes a run's folder; without a folder everything stays in memory.

    `ticks` is the stream for a `TickLog`, `signals` for a `SignalWriter`. At the end the streams are closed and
    result.json is written: the result given to `finish` or, if the run did not get so far, one that names the
    interrupt or the error.
    """

    def __init__(
        self,
        folder: Path | None,
        scenario: str,
        seed: int,
        case: str = DEFAULT_CASE,
        copies: Mapping[str, str] | None = None,
        task: str = "",
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
        self._task = task
        self.events: TextIO = io.StringIO()
        self.ticks: TextIO = io.StringIO()
        self.signals: BinaryIO = io.BytesIO()
        self._at_work: BinaryIO = io.BytesIO()
        self._longest = 0
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            if found := folders.run_folder_findings(folder):
                raise Findings(found)
            try:
                self.events = (folder / "events.jsonl").open("x", encoding="utf-8", newline="\n")
            except FileExistsError:  # another run has just taken the folder
                raise Findings(folders.existing_run_findings(folder)) from None
            self._at_work = (folder / AT_WORK).open("wb", buffering=0)
            self.at_work(0.0, "")
            self.ticks = (folder / "ticks.jsonl").open("x", encoding="utf-8", newline="\n")
            self.signals = (folder / signals.FILE).open("xb")
            for name, text in (copies or {}).items():
                (folder / name).write_text(text, encoding="utf-8", newline="\n")

    def logger(self, now: Callable[[], float], on_event: OnEvent | None = None) -> Any:
        """A structlog logger into events.jsonl; each line begins with `t`, the simulated second by `now`.

        `on_event`, too, gets each event's values.
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
        """Note that the leaf at path `node` begins its tick at second `t`; "" for its path: the tick has ended.

        If the process dies or hangs within the tick, only this note names the leaf.
        """
        line = json.dumps({"t": round(t, 6), "node": node}).ljust(self._longest)
        self._longest = len(line)  # padded: a single write replaces a longer line completely
        self._at_work.seek(0)
        self._at_work.write(line.encode() + b"\n")

    def finish(self, result: Result) -> None:
        """Set the run's result, which is written when the record closes; a later call replaces it."""
        self.result = result

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with signals_deferred():
            if self.result is None:
                self.result = self._cut_short(error)
            if self.folder is not None:
                self.events.close()
                self.ticks.close()
                self.signals.close()
                self._at_work.close()
                write_whole(self.folder / "result.json", self.result.to_json())
                (self.folder / AT_WORK).unlink(missing_ok=True)

    def _cut_short(self, error: BaseException | None) -> Result:
        if isinstance(error, KeyboardInterrupt):
            code = CauseCode.WALL_LIMIT if isinstance(error, WallLimit) else CauseCode.INTERRUPTED
            cause = Cause(code, "stopped from outside before the run could end")
            outcome: Outcome = "wall_limit" if isinstance(error, WallLimit) else "interrupted"
            return Result(
                self._scenario, self._seed, outcome, succeeded=False, task=self._task, case=self._case, cause=cause
            )
        message = f"{type(error).__name__}: {error}" if error else "the run ended without a result"
        cause = Cause(CauseCode.INTERNAL_ERROR, message)
        trace = "".join(traceback.format_exception(error)) if error else None
        return Result(
            self._scenario,
            self._seed,
            "internal_error",
            succeeded=False,
            task=self._task,
            case=self._case,
            cause=cause,
            traceback=trace,
        )


def finish_killed(folder: Path, run: Result) -> Result:
    """Finish the record of a run whose process is gone: add the leaf that was at work to the result `run`.

    Returns the result. It is written if the folder holds a run that has none.
    """
    if run.cause is not None and (leaf := leaf_at_work(folder)):
        run = dataclasses.replace(run, cause=dataclasses.replace(run.cause, node=leaf[1]), sim_seconds=leaf[0])
    if (folder / "events.jsonl").is_file() and not os.path.lexists(folder / "result.json"):
        with signals_deferred():
            write_whole(folder / "result.json", run.to_json())
            (folder / AT_WORK).unlink(missing_ok=True)
    return run


def leaf_at_work(folder: Path) -> tuple[float, str] | None:
    """The simulated second and the path of the leaf in whose tick a run was killed or hangs; None if in none."""
    try:
        noted = json.loads((folder / AT_WORK).read_bytes()[:MAX_AT_WORK_BYTES])
        t, node = float(noted["t"]), noted["node"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return (t, node) if isinstance(node, str) and node and math.isfinite(t) else None
