"""Whether covariances mean something: how often the truth lies in an estimate's 95 % regions, frame by frame."""

import json
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import RigidTransform
from scipy.stats import chi2

from regrasp.app.files.whole_file import write_whole
from regrasp.app.records.result import plain, versions
from regrasp.app.studies.pose.scenes import HEADLINE
from regrasp.app.studies.pose.tasks import run_tasks
from regrasp.app.studies.pose.trial import Setup
from regrasp.app.studies.statistics import wilson_interval
from regrasp.app.studies.table import print_table
from regrasp.perception.pose.estimate import Estimate

FRAMES = 10  # of a seed: 200 seeds give 2,000
LEVEL = 0.95
POSITION_LIMIT, AXIS_LIMIT = float(chi2.ppf(LEVEL, 3)), float(chi2.ppf(LEVEL, 2))  # squared Mahalanobis distances


@dataclass(frozen=True)
class Cover:
    """One frame's estimate against the truth."""

    technique: str
    configuration: str
    seed: int
    position: float  # squared Mahalanobis distance of the truth, 3 degrees of freedom
    axis: float  # the same of the axis, 2 degrees of freedom
    error_m: float
    axis_error_deg: float


@dataclass(frozen=True)
class Look:
    """What one technique gave in the frames of a scene."""

    technique: str
    frames: int
    covers: tuple[Cover, ...]

    def __str__(self) -> str:
        inside = sum(c.position <= POSITION_LIMIT for c in self.covers)
        return f"{self.technique} {inside} of {len(self.covers)} inside"


def run_coverage(setups: Sequence[Setup], seeds: range, jobs: int, out: Path | None) -> int:
    """Ten frames of every seed, which also chooses the configuration, to each technique by itself, without a mean.

    Progress goes to stderr, a table to stdout, the figures to out/coverage.json. Returns the exit code as `run_tasks`.

    Raises OSError when `out` cannot be written.
    """
    tasks = {}
    for seed, setup in product(seeds, setups):
        name = HEADLINE[seed % len(HEADLINE)]
        tasks[f"{', '.join(setup.techniques)} in configuration {name} seed {seed}"] = partial(look, setup, name, seed)
    techniques = [name for setup in setups for name in setup.techniques]
    looks, code = run_tasks(tasks, jobs, lambda some: _write(out, some, techniques, seeds))
    _write(out, looks, techniques, seeds)
    print_table(_HEADER, [_line(name, coverage(name, looks)) for name in techniques])
    return code


def look(setup: Setup, configuration: str, seed: int) -> list[Look]:
    """What each technique gives in the first frames of a scene, every frame new to it."""
    with setup.scene(configuration, seed) as scene:
        frames, truth = list(scene.frames(FRAMES)), scene.truth.connector_pose()
        found = []
        for name in setup.techniques:
            estimates = [setup.technique(name).estimate(frame, scene.world_from_camera) for frame in frames]
            covers = tuple(
                Cover(name, configuration, seed, *distances(e, truth), *errors(e, truth))
                for e in estimates
                if isinstance(e, Estimate)
            )
            found.append(Look(name, len(frames), covers))
    return found


def distances(estimate: Estimate, truth: RigidTransform) -> tuple[float, float]:
    """Squared Mahalanobis distances of the true position and of the true axis' line, which either end may lead."""
    away = truth.translation - estimate.position
    position = float(away @ np.linalg.solve(estimate.covariance[:3, :3], away))
    true_axis = truth.rotation.apply([1.0, 0.0, 0.0])
    turn = np.cross(estimate.axis, true_axis * (1.0 if true_axis @ estimate.axis >= 0 else -1.0))
    sine = float(np.linalg.norm(turn))
    turn *= float(np.arcsin(min(1.0, sine))) / max(sine, 1e-12)
    across = np.linalg.svd(estimate.axis[None])[2][1:]  # (2, 3): the turns that move the axis
    within = across @ estimate.covariance[3:, 3:] @ across.T
    return position, float(across @ turn @ np.linalg.solve(within, across @ turn))


def errors(estimate: Estimate, truth: RigidTransform) -> tuple[float, float]:
    """Distance in m, and degrees between the axes' lines."""
    cosine = abs(float(estimate.axis @ truth.rotation.apply([1.0, 0.0, 0.0])))
    return float(np.linalg.norm(estimate.position - truth.translation)), float(np.rad2deg(np.arccos(min(1.0, cosine))))


def coverage(technique: str, looks: Sequence[Look]) -> dict[str, Any]:
    """Counts [k, n] of the truths within the 95 % regions, and errors, of one technique. None: no estimate."""
    own = [look for look in looks if look.technique == technique]
    covers = [cover for look in own for cover in look.covers]
    by_name = {name: [c for c in covers if c.configuration == name] for name in HEADLINE}
    return {
        "estimates": [len(covers), sum(look.frames for look in own)],
        **_inside(covers),
        "mean_error_m": statistics.fmean(c.error_m for c in covers) if covers else None,
        "median_axis_error_deg": statistics.median(c.axis_error_deg for c in covers) if covers else None,
        "by_configuration": {name: _inside(some) for name, some in by_name.items() if some},
    }


def _inside(covers: Sequence[Cover]) -> dict[str, list[int]]:
    return {
        "position": [sum(c.position <= POSITION_LIMIT for c in covers), len(covers)],
        "axis": [sum(c.axis <= AXIS_LIMIT for c in covers), len(covers)],
    }


def _write(out: Path | None, looks: Sequence[Look], techniques: Sequence[str], seeds: range) -> None:
    if out is None or not looks:  # nothing was done, and nothing stands in the way of another try
        return
    out.mkdir(parents=True, exist_ok=True)
    figures = {
        "schema": 1,
        "level": LEVEL,
        "seeds": list(seeds),
        "versions": versions(),
        "techniques": {name: coverage(name, looks) for name in techniques},
    }
    write_whole(out / "coverage.json", json.dumps(plain(figures), indent=2, allow_nan=False) + "\n")


_HEADER = (
    "technique",
    "estimates",
    "position in 95 %",
    "interval",
    "axis in 95 %",
    "interval",
    "mean error mm",
    "axis deg",
)


def _line(name: str, found: dict[str, Any]) -> tuple[str, ...]:
    if not found["estimates"][0]:
        return name, f"0/{found['estimates'][1]}", *["-"] * (len(_HEADER) - 2)
    shares = []
    for key in ("position", "axis"):
        k, n = found[key]
        low, high = wilson_interval(k, n)
        shares += [f"{100 * k / n:.1f} %", f"{100 * low:.1f} to {100 * high:.1f} %"]
    k, n = found["estimates"]
    return name, f"{k}/{n}", *shares, f"{1e3 * found['mean_error_m']:.1f}", f"{found['median_axis_error_deg']:.1f}"
