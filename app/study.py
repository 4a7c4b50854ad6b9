"""Studies: many runs, counted."""

import contextlib
import json
import math
import statistics
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, Literal, NamedTuple

from rich.console import Console
from rich.table import Table

from app.processes import Done, run_each
from app.record import Result, plain, versions, write_whole

SCENARIOS = ("no_obstacle", "short_obstacle", "tall_obstacle")
GRAVITIES: tuple[Literal["zero", "earth"], ...] = ("zero", "earth")
_Z = 1.959964  # of the normal distribution, for 95 %


class Case(NamedTuple):
    """One run of a study."""

    scenario: str
    gravity: str
    seed: int

    @property
    def group(self) -> str:
        """Scenario and gravity."""
        return f"{self.scenario} {self.gravity}"

    def __str__(self) -> str:
        return f"{self.group} seed {self.seed}"


@dataclass(frozen=True)
class Row:
    """What a study keeps of a run. Seconds are simulated ones but for the factor, forces newtons; None: not known."""

    scenario: str
    gravity: str
    seed: int
    outcome: str
    succeeded: bool
    cause: dict[str, Any] | None
    peak_memory_mb: float
    slips: int = 0
    detection_delays: list[float] = field(default_factory=list)
    detected_by: list[str] = field(default_factory=list)
    found_by: str | None = None
    unintended_force: float | None = None
    unmet: list[str] = field(default_factory=list)
    sim_seconds: float = 0.0
    real_time_factor: float = 0.0


def run_demo(
    seeds: range,
    jobs: int,
    out: Path | None,
    overrides: Sequence[str] = (),
    load: Callable[[str, list[str]], Any] | None = None,
    episode: Callable[..., Result] | None = None,
) -> int:
    """The whole demonstration: three scenarios in two gravities, each with every seed, each run in its own process.

    Progress goes to stderr, a table to stdout; with `out`, runs go to out/runs/ and the figures to out/demo.json, which
    is whole after every run. Returns the exit code: 0 when all runs came to an end, however they went, 130 after
    Ctrl-C, 2 when `out` holds a study. `load` and `episode` stand in for the real ones in tests.

    Raises:
        app.findings.Findings: a scenario with these overrides is wrong.
        OSError: `out` cannot be written.
    """
    if load is None or episode is None:
        from app.episode import run_episode  # late: they bring the physics
        from app.scenario_file import load_scenario

        load, episode = load or load_scenario, episode or run_episode
    if out is not None and (out / "demo.json").exists():
        print(f"{out} holds a study already (demo.json)", file=sys.stderr)
        return 2
    cases = [Case(*key) for key in product(SCENARIOS, GRAVITIES, seeds)]
    loaded = {f"{name} {g}": load(name, [*overrides, f"gravity={g}"]) for name, g in product(SCENARIOS, GRAVITIES)}
    tasks = [partial(episode, loaded[c.group], _folder(out, c), seed=c.seed, video=False) for c in cases]
    rows, code = _collect(cases, tasks, jobs, lambda rows: _write(out, rows, cases, overrides))
    _write(out, rows, cases, overrides)
    print_table(_HEADER, table(rows))
    return code


def _folder(out: Path | None, case: Case) -> Path | None:
    return out and out / "runs" / f"{case.scenario}-{case.gravity}-{case.seed}"


def _collect(
    cases: Sequence[Case], tasks: Sequence[Callable[[], Result]], jobs: int, keep: Callable[[list[Row]], None]
) -> tuple[list[Row], int]:
    """Run all; the rows in the order of the cases, and the exit code."""
    rows: dict[int, Row] = {}
    code = 0
    try:
        with contextlib.closing(run_each(tasks, jobs)) as ended:
            for done in ended:
                case = cases[done.number]
                row = rows[done.number] = row_of(case, done)
                keep([rows[i] for i in sorted(rows)])
                print(f"[{len(rows)}/{len(cases)}] {case}: {_summary(row)}", file=sys.stderr, flush=True)
    except KeyboardInterrupt:
        print(f"interrupted; {len(rows)} of {len(cases)} runs were done", file=sys.stderr)
        code = 130
    return [rows[i] for i in sorted(rows)], code


def _summary(row: Row) -> str:
    verdict = row.outcome if row.succeeded else f"{row.outcome}, not as expected"
    return f"{verdict}, {row.sim_seconds:.1f} s simulated, {row.real_time_factor:.2f} x real time"


def row_of(case: Case, done: Done[Result]) -> Row:
    """A run's row; one whose process died counts as an internal error."""
    result = done.value
    if result is None:
        cause = {"code": "internal_error", "message": done.error, "node": ""}
        return Row(*case, "internal_error", succeeded=False, cause=cause, peak_memory_mb=done.peak_memory_mb)
    values = {e.name: e.value for e in result.expectations}
    return Row(
        *case,
        outcome=result.outcome,
        succeeded=result.succeeded,
        cause=asdict(result.cause) if result.cause else None,
        slips=len(result.slips),
        detection_delays=[s.detected_at - s.released_at for s in result.slips if s.detected_at is not None],
        detected_by=[s.detected_by for s in result.slips if s.detected_by],
        found_by=values.get("found_by"),
        unintended_force=values.get("unintended_force"),
        unmet=[e.name for e in result.expectations if not e.met],
        sim_seconds=result.sim_seconds,
        real_time_factor=result.real_time_factor,
        peak_memory_mb=round(done.peak_memory_mb, 1),
    )


def _write(out: Path | None, rows: list[Row], cases: Sequence[Case], overrides: Sequence[str]) -> None:
    if out is None:
        return
    out.mkdir(parents=True, exist_ok=True)
    summary = {
        "schema": 1,
        "runs": len(rows),
        "succeeded": sum(row.succeeded for row in rows),
        "planned": len(cases),
        "seeds": sorted({case.seed for case in cases}),
        "overrides": list(overrides),
        "versions": versions(),
        "rows": [asdict(row) for row in rows],
    }
    write_whole(out / "demo.json", json.dumps(plain(summary), indent=2, allow_nan=False) + "\n")


def wilson(k: int, n: int) -> tuple[float, float]:
    """The 95 % score interval of a share from k successes in n trials (Wilson 1927); (0, 1) without trials."""
    if n == 0:
        return 0.0, 1.0
    p, z2 = k / n, _Z**2
    middle = (p + z2 / (2 * n)) / (1 + z2 / n)
    half = _Z / (1 + z2 / n) * math.sqrt(p * (1 - p) / n + z2 / (4 * n**2))
    return max(0.0, middle - half), min(1.0, middle + half)


_HEADER = ("case", "succeeded", "95 % interval", "median sim s", "median x real time", "max force N")


def table(rows: Sequence[Row]) -> list[tuple[str, ...]]:
    """The lines below the header: one a case that has runs, in their order, and one over all."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(f"{row.scenario} {row.gravity}", []).append(row)
    return [_line(name, group) for name, group in groups.items()] + [_line("all", rows)]


def _line(name: str, rows: Sequence[Row]) -> tuple[str, ...]:
    succeeded = sum(row.succeeded for row in rows)
    low, high = wilson(succeeded, len(rows))
    forces = [row.unintended_force for row in rows if row.unintended_force is not None]
    return (
        name,
        f"{succeeded}/{len(rows)}",
        f"{100 * low:.1f} to {100 * high:.1f} %",
        f"{statistics.median(row.sim_seconds for row in rows):.1f}" if rows else "-",
        f"{statistics.median(row.real_time_factor for row in rows):.2f}" if rows else "-",
        f"{max(forces):.2f}" if forces else "-",
    )


def print_table(header: Sequence[str], lines: Sequence[Sequence[str]]) -> None:
    """A table on stdout: drawn on a terminal, plain aligned columns in a pipe; the first column to the left."""
    if sys.stdout.isatty():
        drawn = Table(*header)
        for column in drawn.columns[1:]:
            column.justify = "right"
        for line in lines:
            drawn.add_row(*line)
        Console().print(drawn)
        return
    widths = [max(len(line[i]) for line in (header, *lines)) for i in range(len(header))]
    for line in (header, *lines):
        cells = [cell.rjust(width) for cell, width in zip(line[1:], widths[1:], strict=True)]
        print("  ".join([line[0].ljust(widths[0]), *cells]))
