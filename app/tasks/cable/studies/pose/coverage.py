"""Coverage of the covariances: how often the truth lies in the 95 % region of an estimate from a single frame."""

import json
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter
from scipy.spatial.transform import RigidTransform
from scipy.stats import chi2

from regrasp.app.campaigns.digest import digest_of
from regrasp.app.campaigns.statistics import wilson_interval
from regrasp.app.campaigns.table import print_table
from regrasp.app.files.whole_file import write_whole
from regrasp.app.records.result import plain, versions
from regrasp.app.studies.scene_tasks import SceneTask, run_tasks
from regrasp.app.tasks.cable.studies.pose.scenes import HEADLINE
from regrasp.app.tasks.cable.studies.pose.trial import Setup
from regrasp.perception.pose.estimate import Estimate

KIND = "scenes of a coverage study"
LEVEL = 0.95
POSITION_LIMIT, AXIS_LIMIT = float(chi2.ppf(LEVEL, 3)), float(chi2.ppf(LEVEL, 2))  # squared Mahalanobis distances


@dataclass(frozen=True)
class FrameCoverage:
    """One frame's estimate against the truth."""

    technique: str
    configuration: str
    seed: int
    position_mahalanobis_sq: float  # 3 degrees of freedom
    axis_mahalanobis_sq: float  # 2 degrees of freedom
    error_m: float
    axis_error_deg: float


@dataclass(frozen=True)
class SceneCoverage:
    """One technique in the frames of a scene: `found` holds those in which it found the connector."""

    technique: str
    frames: int
    found: tuple[FrameCoverage, ...]

    def __str__(self) -> str:
        inside = sum(frame.position_mahalanobis_sq <= POSITION_LIMIT for frame in self.found)
        return f"{self.technique} {inside} of {len(self.found)} inside"


def run_coverage(setups: Sequence[Setup], seeds: range, jobs: int, out: Path | None, frames_per_seed: int = 10) -> int:
    """Give each technique the first frames of a scene for every seed, each frame by itself, and count.

    The seed also chooses the configuration. Progress goes to stderr, a table to stdout, the figures to
    out/coverage.json; each scene is kept in `out` as it ends. Returns the exit code of `run_tasks`.

    Raises:
        OSError: `out` cannot be written.
    """
    tasks = {}
    for seed, setup in product(seeds, setups):
        name = HEADLINE[seed % len(HEADLINE)]
        title = f"{', '.join(setup.techniques)} in configuration {name} seed {seed}"
        run = partial(cover_scene, setup, name, seed, frames_per_seed)
        tasks[title] = SceneTask(run, digest_of(title, setup.digest, frames_per_seed))
    techniques = [name for setup in setups for name in setup.techniques]
    scenes, code = run_tasks(tasks, jobs, out, KIND, TypeAdapter(list[SceneCoverage]))
    _write(out, scenes, techniques, seeds)
    print_table(_HEADER, [_line(name, coverage_figures(name, scenes)) for name in techniques])
    return code


def cover_scene(setup: Setup, configuration: str, seed: int, frame_count: int = 10) -> list[SceneCoverage]:
    """Each technique in the first frames of a scene; it is made anew for every frame."""
    with setup.scene(configuration, seed) as scene:
        frames, truth = list(scene.frames(frame_count)), scene.truth.connector_pose()
        scenes = []
        for name in setup.techniques:
            results = [setup.technique(name).estimate(frame, scene.world_from_camera) for frame in frames]
            found = tuple(
                FrameCoverage(name, configuration, seed, *mahalanobis_sq(e, truth), *pose_errors(e, truth))
                for e in results
                if isinstance(e, Estimate)
            )
            scenes.append(SceneCoverage(name, len(frames), found))
    return scenes


def mahalanobis_sq(estimate: Estimate, truth: RigidTransform) -> tuple[float, float]:
    r"""Squared Mahalanobis distances of the true position and of the true axis (Mahalanobis 1936).

    .. math:: d^2 = e^T \Sigma^{-1} e

    For the position, e is the error (3,) in m. For the axis, e is the rotation (2,) in rad, across the estimated axis,
    that turns it to the true one; axes are lines, so the true axis is taken with the nearer sign.
    """
    error = truth.translation - estimate.position
    position = float(error @ np.linalg.solve(estimate.covariance[:3, :3], error))
    true_axis = truth.rotation.apply([1.0, 0.0, 0.0])
    turn = np.cross(estimate.axis, true_axis * (1.0 if true_axis @ estimate.axis >= 0 else -1.0))
    sine = float(np.linalg.norm(turn))
    turn *= float(np.arcsin(min(1.0, sine))) / max(sine, 1e-12)
    across = np.linalg.svd(estimate.axis[None])[2][1:]  # (2, 3): the rotations that move the axis
    covariance = across @ estimate.covariance[3:, 3:] @ across.T
    return position, float(across @ turn @ np.linalg.solve(covariance, across @ turn))


def pose_errors(estimate: Estimate, truth: RigidTransform) -> tuple[float, float]:
    """The distance in m, and the angle between the axes as lines in degrees."""
    cosine = abs(float(estimate.axis @ truth.rotation.apply([1.0, 0.0, 0.0])))
    return float(np.linalg.norm(estimate.position - truth.translation)), float(np.rad2deg(np.arccos(min(1.0, cosine))))


def coverage_figures(technique: str, scenes: Sequence[SceneCoverage]) -> dict[str, Any]:
    """A technique's figures: counts [k, n] of the truths within the 95 % regions, and errors. None: no estimate."""
    own = [scene for scene in scenes if scene.technique == technique]
    found = [frame for scene in own for frame in scene.found]
    by_name = {name: [frame for frame in found if frame.configuration == name] for name in HEADLINE}
    return {
        "estimates": [len(found), sum(scene.frames for scene in own)],
        **_inside(found),
        "mean_error_m": statistics.fmean(frame.error_m for frame in found) if found else None,
        "median_axis_error_deg": statistics.median(frame.axis_error_deg for frame in found) if found else None,
        "by_configuration": {name: _inside(frames) for name, frames in by_name.items() if frames},
    }


def _inside(frames: Sequence[FrameCoverage]) -> dict[str, list[int]]:
    return {
        "position": [sum(frame.position_mahalanobis_sq <= POSITION_LIMIT for frame in frames), len(frames)],
        "axis": [sum(frame.axis_mahalanobis_sq <= AXIS_LIMIT for frame in frames), len(frames)],
    }


def _write(out: Path | None, scenes: Sequence[SceneCoverage], techniques: Sequence[str], seeds: range) -> None:
    if out is None or not scenes:  # nothing was done: no file that would refuse another try
        return
    out.mkdir(parents=True, exist_ok=True)
    figures = {
        "schema": 1,
        "level": LEVEL,
        "seeds": list(seeds),
        "versions": versions(),
        "techniques": {name: coverage_figures(name, scenes) for name in techniques},
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
