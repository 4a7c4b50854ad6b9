"""`regrasp study motion`: retrieval queries in cluttered cells to our planner and birrt, counted.

A query counts as feasible when another planner with ten times the effort finds a path for it (`reference_path`); ours
has no say in it. Those that a straight motion solves are left out. What is infeasible is so by construction
(`infeasible.py`). Times are those of the thread's processor: what other programs do on the machine does not count.
"""

import statistics
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from regrasp.app.campaigns.digest import digest_of
from regrasp.app.campaigns.statistics import wilson_interval
from regrasp.app.campaigns.table import print_table
from regrasp.app.studies.figures import write_figures
from regrasp.app.studies.scene_tasks import SceneTask, run_tasks
from regrasp.app.tasks.cable.cells import cable_cell
from regrasp.app.tasks.cable.studies.motion.infeasible import INFEASIBLE
from regrasp.app.tasks.cable.studies.motion.trial import (
    OURS,
    Answer,
    InfeasibleRow,
    QueryRow,
    Row,
    TrialParameters,
    run_trial,
)
from regrasp.interfaces.quote import printable

KIND = "queries of a motion study"
CELL = "thesis"
EXTRA = "pip install -e '.[bench]' in the project's folder brings it"
_ROWS: TypeAdapter[list[Row]] = TypeAdapter(list[Row])


def run_motion(seeds: range, jobs: int, out: Path | None, parameters: TrialParameters | None = None) -> int:
    """Ask a query, or what cannot be done, for every seed.

    Progress goes to stderr, tables to stdout, the figures to out/motion.json; each query is kept in `out` as it ends.
    Returns the exit code of `run_tasks`.

    Raises:
        OSError: `out` cannot be written.
    """
    cell, parameters = cable_cell(CELL), parameters or TrialParameters()
    digest = digest_of(cell.model_dump(mode="json"), asdict(parameters))
    tasks = {
        f"query {seed}": SceneTask(partial(run_trial, cell, seed, parameters), digest_of(seed, digest))
        for seed in seeds
    }
    rows, code = run_tasks(tasks, jobs, out, KIND, _ROWS)
    figures = motion_figures(rows, parameters)
    if out is not None and rows:  # else nothing was done: no file that would refuse another try
        found = figures | {"rows": _ROWS.dump_python(rows, mode="json")}
        write_figures(out / "motion.json", seeds, found, **_extras())
    _print(rows, figures)
    return code


def motion_figures(rows: Sequence[Row], parameters: TrialParameters) -> dict[str, Any]:
    """The figures of motion.json. Counts are [k, n]; None: no value, and a sentence beside it says why.

    Times are of all queries, path lengths of those that every planner solved.
    """
    queries, infeasible = _queries(rows), [row for row in rows if isinstance(row, InfeasibleRow)]
    both = [row for row in queries if all(answer.path_length_rad is not None for answer in row.answers.values())]
    names = list(queries[0].answers) if queries else [OURS]
    planners = {
        name: _planner_figures([r.answers[name] for r in queries], [r.answers[name] for r in both]) for name in names
    }
    checked = [row.touched for row in queries if row.touched is not None]
    return {
        **planners.pop(OURS),
        "infeasible_named": [sum(row.named for row in infeasible), len(infeasible)],
        "contacts": sum(bool(touched) for touched in checked) if parameters.coal else None,
        "contacts_checked": len(checked),
        "contacts_why": "" if parameters.coal else f"coal is not installed; {EXTRA}",
        "birrt": planners if parameters.birrt else None,
        "birrt_why": "" if parameters.birrt else f"pybullet-planning is not installed; {EXTRA}",
        "paths_compared": len(both),
        "left_out": {
            "straight": sum(row.straight for row in queries),
            "unproven": sum(row.unproven for row in queries),
            "unproven_solved": sum(row.unproven_solved for row in queries),
        },
        "infeasible": {kind: _infeasible_figures([r for r in infeasible if r.kind == kind]) for kind in INFEASIBLE},
    }


def _queries(rows: Sequence[Row]) -> list[QueryRow]:
    return [row for row in rows if isinstance(row, QueryRow)]


def _planner_figures(answers: Sequence[Answer], compared: Sequence[Answer]) -> dict[str, Any]:
    times = [answer.plan_ms for answer in answers]
    lengths = [answer.path_length_rad for answer in compared if answer.path_length_rad is not None]
    return {
        "solved": [sum(answer.path_length_rad is not None for answer in answers), len(answers)],
        "plan_ms": {
            "median": statistics.median(times) if times else None,
            "p95": float(np.quantile(times, 0.95)) if times else None,
        },
        "path_length_rad": statistics.median(lengths) if lengths else None,
        "mean_path_length_rad": statistics.fmean(lengths) if lengths else None,
    }


def _infeasible_figures(rows: Sequence[InfeasibleRow]) -> dict[str, Any]:
    return {
        "named": [sum(row.named for row in rows), len(rows)],
        "expected": rows[0].expected if rows else None,
        "max_ms": max((row.plan_ms for row in rows), default=None),
    }


def _extras() -> dict[str, str]:
    """Versions of what the study compares with, as far as it is installed."""
    found = {}
    for name in ("coal", "pybullet-planning"):
        with suppress(PackageNotFoundError):
            found[name] = version(name)
    return found


_HEADER = ("planner", "solved", "95 %", "median ms", "95 % ms", "times ours", "median path rad", "mean path rad")
_INFEASIBLE_HEADER = ("what cannot be done", "named", "cause", "most ms")


def _print(rows: Sequence[Row], figures: dict[str, Any]) -> None:
    ours = figures["plan_ms"]["median"]
    planners = {OURS: figures, **(figures["birrt"] or {})}
    print_table(_HEADER, [_planner_line(name, found, ours) for name, found in planners.items()])
    print()
    kinds = figures["infeasible"]
    lines = [
        (kind, _count(found["named"]), found["expected"] or "-", _figure(found["max_ms"]))
        for kind, found in kinds.items()
    ]
    print_table(_INFEASIBLE_HEADER, [*lines, ("all", _count(figures["infeasible_named"]), "", "")])
    print()
    for sentence in _sentences(rows, figures):
        print(printable(sentence))


def _planner_line(name: str, found: dict[str, Any], ours: float | None) -> tuple[str, ...]:
    low, high = wilson_interval(*found["solved"])
    times = found["plan_ms"]
    ratio = times["median"] / ours if ours and times["median"] is not None else None
    lengths = (f"{value:.2f}" if value else "-" for value in (found["path_length_rad"], found["mean_path_length_rad"]))
    shares = (_count(found["solved"]), f"{100 * low:.0f} to {100 * high:.0f} %")
    return name, *shares, *map(_figure, (times["median"], times["p95"], ratio)), *lengths


def _sentences(rows: Sequence[Row], figures: dict[str, Any]) -> Iterator[str]:
    """What the tables leave out, and what went wrong, a seed a line."""
    if figures["contacts"] is None:
        yield f"paths not checked by meshes: {figures['contacts_why']}"
    else:
        yield f"{figures['contacts']} of {figures['contacts_checked']} paths touch something by coal's meshes"
    if figures["birrt"] is None:
        yield f"birrt left out: {figures['birrt_why']}"
    else:
        yield f"paths are compared on the {figures['paths_compared']} queries that all solved"
    left = figures["left_out"]
    yield (
        f"drawn and left out: {left['straight']} queries that a straight motion solves, {left['unproven']} for which "
        f"the reference found no path ({left['unproven_solved']} of these ours solved)"
    )
    for row in rows:
        wrong = not row.named if isinstance(row, InfeasibleRow) else bool(row.why or row.touched)
        if wrong:
            yield f"seed {row.seed}, {row}"


def _count(pair: Sequence[int]) -> str:
    return f"{pair[0]}/{pair[1]}" if pair[1] else "-"


def _figure(value: float | None) -> str:
    return "-" if value is None else f"{value:.1f}"
