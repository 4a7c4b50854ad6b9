"""`regrasp study demo`: the whole demonstration over many seeds, counted."""

import json
import statistics
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from regrasp.app.campaigns.campaign import Effort, Local, do_all, version_of
from regrasp.app.campaigns.episodes import KIND, Stored, jobs_of, row_in
from regrasp.app.campaigns.progress import Progress
from regrasp.app.campaigns.statistics import wilson_interval
from regrasp.app.campaigns.store import Store
from regrasp.app.campaigns.table import print_table
from regrasp.app.files.whole_file import write_whole
from regrasp.app.records.result import plain, versions
from regrasp.app.run.batch import Row, Run, RunEpisode, Settings
from regrasp.app.scenario.load import cases
from regrasp.app.studies.wall_parts import PARTS_HEADER, part_lines

SCENARIOS = ("no_obstacle", "short_obstacle", "tall_obstacle")


def run_demo(
    seeds: range,
    jobs: int,
    out: Path | None,
    overrides: Sequence[str] = (),
    settings: Settings = Settings(),  # noqa: B008 - it does not change
    episode: RunEpisode | None = None,
) -> int:
    """Run every case of three scenarios with every seed, each run in its own process.

    Progress goes to stderr, a table to stdout. With `out`, it is a campaign there: the runs' records go to out/runs/,
    the same study again goes on where it stopped, and in the end the figures go to out/demo.json. Returns the exit
    code: 0 when all runs came to an end, also to a failure; 130 after Ctrl-C. `episode` replaces `run_episode` in
    tests.

    Raises:
        Findings: a scenario with these overrides is wrong.
        OSError: `out` cannot be written.
    """
    chosen = [case for name in SCENARIOS for case in cases(name, overrides)]
    runs = [Run(case, seed) for case in chosen for seed in seeds]
    asked = jobs_of(runs, settings, episode)
    with Store.create(out, KIND) as store:
        effort = Effort(wall_limit=settings.wall_limit)
        ended, progress = Stored(runs, "all", effort.wall_limit), Progress(settings.quiet)
        interrupted = do_all(asked, store, Local(jobs), ended, progress, effort)
        done = {stored.key: row_in(stored) for stored in store.rows(version_of(store, asked))}
    rows = [done[job.key] for job in asked if job.key in done]
    _write(out, rows, runs, overrides)
    print_table(_HEADER, table_lines(rows))
    if parts := part_lines(rows):
        print()
        print_table(PARTS_HEADER, parts)
    return 130 if interrupted else 0


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


_HEADER = (
    *("case", "succeeded", "95 % interval", "median sim s", "median x real time", "max force N"),
    *("longest tick s", "max memory MB"),
)


def table_lines(rows: Sequence[Row]) -> list[tuple[str, ...]]:
    """The lines below the header: one for each case that has runs, in their order, and one for all runs."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(f"{row.scenario} {row.case}", []).append(row)
    return [_line(name, group) for name, group in groups.items()] + [_line("all", rows)]


def _line(name: str, rows: Sequence[Row]) -> tuple[str, ...]:
    succeeded = sum(row.succeeded for row in rows)
    low, high = wilson_interval(succeeded, len(rows))
    forces = [row.unintended_force for row in rows if row.unintended_force is not None]
    return (
        name,
        f"{succeeded}/{len(rows)}",
        f"{100 * low:.1f} to {100 * high:.1f} %",
        f"{statistics.median(row.sim_seconds for row in rows):.1f}" if rows else "-",
        f"{statistics.median(row.real_time_factor for row in rows):.2f}" if rows else "-",
        f"{max(forces):.2f}" if forces else "-",
        f"{max(row.longest_tick for row in rows):.2f}" if rows else "-",
        f"{max(row.peak_memory_mb for row in rows):.0f}" if rows else "-",
    )
