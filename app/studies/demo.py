"""Studies: many runs, counted."""

import json
import math
import statistics
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from regrasp.app.files.whole_file import write_whole
from regrasp.app.records.folders import folder_name
from regrasp.app.records.result import plain, versions
from regrasp.app.run.batch import Row, Run, RunEpisode, Settings, run_all
from regrasp.app.scenario.load import Scenario, cases
from regrasp.app.studies.table import print_table

SCENARIOS = ("no_obstacle", "short_obstacle", "tall_obstacle")
_Z = 1.959964  # of the normal distribution, for 95 %


def run_demo(
    seeds: range,
    jobs: int,
    out: Path | None,
    overrides: Sequence[str] = (),
    settings: Settings = Settings(),  # noqa: B008 - it does not change
    episode: RunEpisode | None = None,
) -> int:
    """The whole demonstration: every case of three scenarios with every seed, each run in its own process.

    Progress goes to stderr, a table to stdout; with `out`, runs go to out/runs/ and the figures to out/demo.json, which
    is whole after every run. Returns the exit code: 0 when all runs came to an end, however they went, 130 after
    Ctrl-C, 2 when `out` holds a study. `episode` stands in for `run_episode` in tests.

    Raises:
        Findings: a scenario with these overrides is wrong.
        OSError: `out` cannot be written.
    """
    if out is not None and (out / "demo.json").exists():
        print(f"{out} holds a study already (demo.json)", file=sys.stderr)
        return 2
    chosen = [case for name in SCENARIOS for case in cases(name, overrides)]
    runs = [Run(case, seed, _folder(out, case, seed)) for case in chosen for seed in seeds]
    done, interrupted = run_all(runs, jobs, lambda rows: _write(out, rows, runs, overrides), settings, episode)
    rows = list(done.values())
    _write(out, rows, runs, overrides)
    print_table(_HEADER, table(rows))
    return 130 if interrupted else 0


def _folder(out: Path | None, case: Scenario, seed: int) -> Path | None:
    return out and out / "runs" / f"{case.name}-{folder_name(case.case)}-{seed}"


def _write(out: Path | None, rows: list[Row], runs: Sequence[Run], overrides: Sequence[str]) -> None:
    if out is None:
        return
    out.mkdir(parents=True, exist_ok=True)
    summary = {
        "schema": 1,
        "runs": len(rows),
        "succeeded": sum(row.succeeded for row in rows),
        "planned": len(runs),
        "seeds": sorted({run.seed for run in runs}),
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
    return min(p, max(0.0, middle - half)), max(p, min(1.0, middle + half))  # rounding: the share itself lies in it


_HEADER = ("case", "succeeded", "95 % interval", "median sim s", "median x real time", "max force N")


def table(rows: Sequence[Row]) -> list[tuple[str, ...]]:
    """The lines below the header: one a case that has runs, in their order, and one over all."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(f"{row.scenario} {row.case}", []).append(row)
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
