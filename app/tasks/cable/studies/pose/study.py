"""`regrasp study pose`: the thesis's pose experiment (Hwang 2024, tables 3 to 6) over many seeds, counted."""

import csv
import io
import json
import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import asdict, fields
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from regrasp.app.campaigns.digest import digest_of
from regrasp.app.campaigns.statistics import wilson_interval
from regrasp.app.campaigns.table import print_table
from regrasp.app.files.whole_file import write_whole
from regrasp.app.records.result import plain, versions
from regrasp.app.studies.scene_tasks import SceneTask, run_tasks
from regrasp.app.tasks.cable.studies.pose.both_cameras import BOTH, run_both
from regrasp.app.tasks.cable.studies.pose.negatives import Negative, run_negatives
from regrasp.app.tasks.cable.studies.pose.scenes import CONFIGURATIONS, HEADLINE
from regrasp.app.tasks.cable.studies.pose.trial import Setup, Trial, run_trials

# Hwang 2024, table 3: of 27 trials identified and grasped, mean error and its standard deviation in m.
THESIS: dict[str, dict[str, Any]] = {
    "fiducial": {"identified": [13, 27], "grasped": [13, 27], "mean_error_m": 0.02881, "std_m": 6.0e-5},
    "rgbd": {"identified": [27, 27], "grasped": [20, 27], "mean_error_m": 0.01081, "std_m": 1.0e-2},
    "detector": {"identified": [21, 27], "grasped": [17, 27], "mean_error_m": 0.02913, "std_m": 9.0e-3},
}

KIND = "scenes of a pose study"
_VALUES: TypeAdapter[list[Trial | Negative]] = TypeAdapter(list[Trial | Negative])


def run_pose(
    setups: Sequence[Setup],
    seeds: range,
    jobs: int,
    out: Path | None,
    configurations: Sequence[str] = tuple(CONFIGURATIONS),
    both: bool = False,
) -> int:
    """Try each technique in every configuration with every seed, and on pictures that show no connector.

    Progress goes to stderr, tables to stdout. With `out`, each scene is kept there as it ends, and the same study goes
    on where it stopped; in the end come out/pose.json, out/pose.csv and plots. With `both`, each technique has a
    second row, with both cameras. Returns the exit code: 0, 130 after Ctrl-C, 1 when a scene ended with an error.

    Raises:
        OSError: `out` cannot be written.
    """
    tasks: dict[str, SceneTask[Trial | Negative]] = {}

    def add(title: str, setup: Setup, run: Callable[[], Sequence[Trial | Negative]]) -> None:
        tasks[title] = SceneTask(run, digest_of(title, setup.digest))

    for seed, setup in product(seeds, setups):
        for name in configurations:
            title = f"{', '.join(setup.techniques)} in configuration {name} seed {seed}"
            add(title, setup, partial(run_trials, setup, name, seed))
            if both:
                add(f"{title}, {BOTH}", setup, partial(run_both, setup, name, seed))
        title = f"{', '.join(setup.techniques)} without connector seed {seed}"
        add(title, setup, partial(run_negatives, setup, seed))
    techniques = [name for setup in setups for name in setup.techniques]
    rows = [*techniques, *(f"{name}, {BOTH}" for name in techniques if both)]
    found, code = run_tasks(tasks, jobs, out, KIND, _VALUES)
    _write(out, found, rows, seeds)
    trials = _trials(found)
    if out is not None and trials:
        from regrasp.app.tasks.cable.studies.pose.plots import write_plots  # late: it brings matplotlib

        write_plots(out, trials, rows, THESIS)
    _print({name: technique_figures(name, found) for name in rows})
    return code


def _trials(found: Sequence[Trial | Negative]) -> list[Trial]:
    return [part for part in found if isinstance(part, Trial)]


def technique_figures(name: str, found: Sequence[Trial | Negative]) -> dict[str, Any]:
    """A technique's figures in pose.json: of the `HEADLINE` configurations together, and of each that was tried."""
    own = [trial for trial in _trials(found) if trial.technique == name]
    negatives = [part for part in found if isinstance(part, Negative) and part.technique == name]
    by_name = {c: [t for t in own if t.configuration == c] for c in CONFIGURATIONS}
    return {
        **trial_figures([t for t in own if t.configuration in HEADLINE]),
        "false_identifications": [sum(n.false for n in negatives), sum(n.frames for n in negatives)],
        "by_configuration": {c: trial_figures(trials) for c, trials in by_name.items() if trials},
    }


def trial_figures(trials: Sequence[Trial], max_force: float = 5.0) -> dict[str, Any]:
    """Counts [k, n] and errors of these trials. None: no value. Contacts with more than `max_force` N count."""
    errors = [t.error_m for t in trials if t.error_m is not None]
    axes = [t.axis_error_deg for t in trials if t.axis_error_deg is not None]
    forces = [t.unintended_force for t in trials if t.unintended_force is not None]
    tried = [t for t in trials if t.grasped is not None]
    return {
        "identified": [sum(t.identified for t in trials), len(trials)],
        "grasped": [sum(bool(t.grasped) for t in tried), len(tried)],
        "mean_error_m": statistics.fmean(errors) if errors else None,
        "std_m": statistics.stdev(errors) if len(errors) > 1 else None,
        "median_axis_error_deg": statistics.median(axes) if axes else None,
        "way_round": [sum(bool(t.way_round) for t in trials), len(axes)],
        "unintended_contacts": [sum(force > max_force for force in forces), len(forces)],
    }


def _write(out: Path | None, found: Sequence[Trial | Negative], techniques: Sequence[str], seeds: range) -> None:
    if out is None:
        return
    out.mkdir(parents=True, exist_ok=True)
    figures = {
        "schema": 1,
        "seeds": list(seeds),
        "versions": versions(),
        "thesis": THESIS,
        "techniques": {name: technique_figures(name, found) for name in techniques},
    }
    write_whole(out / "pose.json", json.dumps(plain(figures), indent=2, allow_nan=False) + "\n")
    rows = io.StringIO(newline="")
    writer = csv.DictWriter(rows, [field.name for field in fields(Trial)], lineterminator="\n")
    writer.writeheader()
    writer.writerows(asdict(trial) for trial in _trials(found))
    write_whole(out / "pose.csv", rows.getvalue())


_HEADER = (
    "technique", "identified", "95 %", "thesis", "grasped", "95 %", "thesis",
    "mean error mm", "std", "thesis", "std", "median axis deg", "false",
)  # fmt: skip
_BY_CONFIGURATION = (
    "technique, configuration", "identified", "grasped", "mean error mm", "std", "median axis deg", "way round",
    "over 5 N",
)  # fmt: skip


def _print(techniques: dict[str, dict[str, Any]]) -> None:
    print_table(_HEADER, [_line(name, found) for name, found in techniques.items()])
    print()
    lines = [
        (
            f"{name} {configuration}",
            _count(found["identified"]),
            _count(found["grasped"]),
            _mm(found["mean_error_m"]),
            _mm(found["std_m"]),
            _figure(found["median_axis_error_deg"]),
            _count(found["way_round"]),
            _count(found["unintended_contacts"]),
        )
        for name, all_found in techniques.items()
        for configuration, found in all_found["by_configuration"].items()
    ]
    print_table(_BY_CONFIGURATION, lines)


def _line(name: str, found: dict[str, Any]) -> tuple[str, ...]:
    thesis = THESIS.get(name, {})
    shares = [
        text
        for key in ("identified", "grasped")
        for text in (_count(found[key]), _interval(found[key]), _share(thesis.get(key)))
    ]
    errors = [_mm(source.get(key)) for source in (found, thesis) for key in ("mean_error_m", "std_m")]
    return name, *shares, *errors, _figure(found["median_axis_error_deg"]), _count(found["false_identifications"])


def _count(pair: Sequence[int]) -> str:
    return f"{pair[0]}/{pair[1]}" if pair[1] else "-"


def _share(pair: Sequence[int] | None) -> str:
    return f"{100 * pair[0] / pair[1]:.1f} %" if pair else "-"


def _interval(pair: Sequence[int]) -> str:
    low, high = wilson_interval(*pair)
    return f"{100 * low:.0f} to {100 * high:.0f} %" if pair[1] else "-"


def _mm(metres: float | None) -> str:
    return _figure(None if metres is None else 1e3 * metres)


def _figure(value: float | None) -> str:
    return "-" if value is None or not math.isfinite(value) else f"{value:.1f}"
