"""The figures of a campaign: what came out by case, why runs failed, and two campaigns side by side."""

import math
import statistics
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from regrasp.app.campaigns.episodes import row_in
from regrasp.app.campaigns.statistics import detectable_share, mcnemar_p, median_interval, wilson_interval
from regrasp.app.campaigns.store import StoredRow
from regrasp.app.run.batch import Row, reason

SUMMARY_SCHEMA = COMPARISON_SCHEMA = 1
PERCENTILES = (5, 50, 95)
ALL = "all"


@dataclass(frozen=True)
class CaseFigures:
    """How the runs of a case came out. `causes`: of those that were not as expected, how many had each.

    `sim_seconds` and `wall_seconds` are the percentiles `PERCENTILES`; `interval` holds the probability of success
    with 95 %.
    """

    case: str
    runs: int
    succeeded: int
    interval: tuple[float, float]
    causes: dict[str, int]
    sim_seconds: tuple[float, ...]
    wall_seconds: tuple[float, ...]
    longest_tick: float  # real seconds
    peak_memory_mb: float


def by_case(rows: Iterable[StoredRow]) -> list[CaseFigures]:
    """The figures of each case, in the order of scenarios and cases, and of all runs last."""
    groups: dict[tuple[str, str], list[Row]] = {}
    for stored in rows:
        row = row_in(stored)
        groups.setdefault((row.scenario, row.case), []).append(row)
    cases = [_figures(f"{scenario} {case}", group) for (scenario, case), group in sorted(groups.items())]
    return [*cases, _figures(ALL, [row for group in groups.values() for row in group])]


def _figures(name: str, rows: Sequence[Row]) -> CaseFigures:
    succeeded = sum(row.succeeded for row in rows)
    timed = [row for row in rows if row.wall_seconds]  # a process that died has told no times
    return CaseFigures(
        case=name,
        runs=len(rows),
        succeeded=succeeded,
        interval=wilson_interval(succeeded, len(rows)),
        causes=dict(Counter(reason(row) for row in rows if not row.succeeded).most_common()),
        sim_seconds=_percentiles([row.sim_seconds for row in timed]),
        wall_seconds=_percentiles([row.wall_seconds for row in timed]),
        longest_tick=max((row.longest_tick for row in rows), default=0.0),
        peak_memory_mb=max((row.peak_memory_mb for row in rows), default=0.0),
    )


def _percentiles(values: Sequence[float]) -> tuple[float, ...]:
    """The `PERCENTILES`, each one of the values."""
    ordered = sorted(values)
    return (
        tuple(round(ordered[max(0, math.ceil(p / 100 * len(ordered)) - 1)], 3) for p in PERCENTILES) if values else ()
    )


@dataclass(frozen=True)
class FailureGroup:
    """Runs that failed for the same reason at the same node, the first of them in full."""

    reason: str
    node: str
    rows: tuple[StoredRow, ...]


def failure_groups(rows: Iterable[StoredRow]) -> list[FailureGroup]:
    """The runs that were not as expected by reason and node, the largest group first."""
    groups: dict[tuple[str, str], list[StoredRow]] = {}
    for stored in rows:
        row = row_in(stored)
        if not row.succeeded:
            node = str((row.cause or {}).get("node") or "")
            groups.setdefault((reason(row), node), []).append(stored)
    ordered = sorted(groups.items(), key=lambda item: (-len(item[1]), item[0]))
    return [FailureGroup(why, node, tuple(held)) for (why, node), held in ordered]


@dataclass(frozen=True)
class Comparison:
    """Two campaigns, scene by scene. A scene is a scenario, its case and a seed.

    `better` succeeded in the second alone, `worse` in the first alone. `p` is McNemar's; `detectable` the smallest
    share of these scenes that, got better with none worse, it would show with a probability of 80 %. Seconds are
    simulated: the median by which the second differs where both succeeded, and its 95 % interval.
    """

    scenes: int
    only_first: int
    only_second: int
    succeeded: tuple[int, int]
    better: tuple[str, ...]
    worse: tuple[str, ...]
    p: float
    detectable: float
    medians: tuple[float, float]
    difference: tuple[float, float, float]


def compare(first: Iterable[StoredRow], second: Iterable[StoredRow]) -> Comparison:
    """The scenes that both have, paired."""
    a, b = _by_scene(first), _by_scene(second)
    both = [scene for scene in a if scene in b]
    better = [scene for scene in both if b[scene].succeeded and not a[scene].succeeded]
    worse = [scene for scene in both if a[scene].succeeded and not b[scene].succeeded]
    timed = [scene for scene in both if a[scene].succeeded and b[scene].succeeded]
    seconds = [[rows[scene].sim_seconds for scene in timed] for rows in (a, b)]
    medians = tuple(statistics.median_low(each) if each else math.nan for each in seconds)
    return Comparison(
        scenes=len(both),
        only_first=len(a) - len(both),
        only_second=len(b) - len(both),
        succeeded=(sum(a[scene].succeeded for scene in both), sum(b[scene].succeeded for scene in both)),
        better=tuple(map(_scene_words, better)),
        worse=tuple(map(_scene_words, worse)),
        p=mcnemar_p(len(better), len(worse)),
        detectable=detectable_share(len(both)),
        medians=(medians[0], medians[1]),
        difference=median_interval([y - x for x, y in zip(*seconds, strict=True)]),
    )


Scene = tuple[str, str, int]


def _by_scene(rows: Iterable[StoredRow]) -> dict[Scene, Row]:
    found = map(row_in, rows)
    return {(row.scenario, row.case, row.seed): row for row in found}


def _scene_words(scene: Scene) -> str:
    return f"{scene[0]} {scene[1]} seed {scene[2]}"


def summary_json(rows: Callable[[], Iterable[StoredRow]], program: Mapping[str, str]) -> dict[str, Any]:
    """What `regrasp campaign show --json` prints."""
    *cases, together = by_case(rows())
    return {
        "schema": SUMMARY_SCHEMA,
        "runs": together.runs,
        "succeeded": together.succeeded,
        "interval": together.interval,
        "percentiles": PERCENTILES,
        "program": dict(program),
        "cases": [asdict(case) for case in cases],
        "all": asdict(together),
    }
