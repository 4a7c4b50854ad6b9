"""What a record's signals show over time, as panels of curves: gaps, distances, speeds, forces, errors of estimates."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from regrasp.app.records.signals import Signals
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.quote import arm_words

POSE_WIDTH = 12  # numbers of a pose: rows of (3, 4)
CHI2_95 = 7.815  # the 95 % quantile of chi square with three degrees of freedom
MAX_SAMPLES = 1500  # of a curve; choice: about the pixels of a wide screen


@dataclass(frozen=True)
class Curve:
    """Values over time; NaN: not known. `dots`: single estimates, not joined by lines."""

    name: str
    t: FloatArray  # (N,) simulated s
    values: FloatArray  # (N,)
    dots: bool = False
    region: FloatArray | None = None  # (N,): from 0 to this lies the error with 95 %


@dataclass(frozen=True)
class Panel:
    """Curves with one axis: what it shows, its unit, and a sentence."""

    title: str
    unit: str
    about: str
    curves: tuple[Curve, ...]


def panels(signals: Signals) -> list[Panel]:
    """The panels that these signals have something for."""
    if "t" not in signals or len(signals["t"]) < 2:
        return []
    made = [_gaps(signals), _distances(signals), _speeds(signals), _forces(signals), _errors(signals)]
    return [panel for panel in made if panel.curves]


def _arms(signals: Signals) -> list[str]:
    return [name.removesuffix(".tool_true") for name in signals if name.endswith(".tool_true")]


def _things(signals: Signals) -> list[str]:
    """What has a true pose and is no arm's tool."""
    width = {signal.name: signal.width for signal in signals.described}
    poses = (name for name in signals if name.endswith("_true") and width[name] == POSE_WIDTH)
    return [name.removesuffix("_true") for name in poses if not name.endswith(".tool_true")]


def positions(poses: FloatArray) -> FloatArray:
    """The positions (N, 3) of poses (N, 12)."""
    return np.asarray(poses, float).reshape(-1, 3, 4)[:, :, 3]


def _gaps(signals: Signals) -> Panel:
    curves = [(arm, signals.get(f"{arm}.gap")) for arm in _arms(signals)]
    found = tuple(_curve(f"{arm} gripper", signals, 1e3 * gap) for arm, gap in curves if gap is not None)
    return Panel("Gap between the pads", "mm", "As the gripper reads it.", found)


def _distances(signals: Signals) -> Panel:
    found = [
        _curve(
            f"{arm} hand to {thing}",
            signals,
            np.linalg.norm(positions(signals[f"{arm}.tool_true"]) - positions(signals[f"{thing}_true"]), axis=1),
        )
        for thing in _things(signals)
        for arm in _arms(signals)
    ]
    things = " and ".join(_things(signals))
    return Panel(f"Distance of the hands to the {things}", "m", "By ground truth.", tuple(found))


def _speeds(signals: Signals) -> Panel:
    found = []
    for arm in _arms(signals):
        joints = signals.get(f"{arm}.joints")
        if joints is not None:
            speed = np.abs(np.diff(joints.reshape(len(joints), -1), axis=0)).max(axis=1) * signals.rate
            found.append(_curve(arm_words(arm).removeprefix("the "), signals, np.append(0.0, speed), peaks=True))
    return Panel("Fastest joint", "rad/s", "As the encoders read; in m/s where the fastest joint slides.", tuple(found))


def _forces(signals: Signals) -> Panel:
    found = []
    for arm in _arms(signals):
        for name, words in (("force_true", "in its grasp"), ("forbidden_force_true", "on what it must not touch")):
            force = signals.get(f"{arm}.{name}")
            if force is not None and np.nanmax(force, initial=0.0) > 0.0:
                found.append(_curve(f"{arm_words(arm).removeprefix('the ')}, {words}", signals, force, peaks=True))
    return Panel("Contact force", "N", "By ground truth; a force that stays 0 is left out.", tuple(found))


def _errors(signals: Signals) -> Panel:
    found = [curve for thing in _things(signals) for curve in _errors_of(thing, signals)]
    about = (
        "Each time it was seen anew, against the truth at that frame. Shaded: the longest half axis of the region that "
        "the estimate itself claims to hold the truth with 95 %."
    )
    return Panel("Error of the estimated position", "mm", about, tuple(found))


def _errors_of(thing: str, signals: Signals) -> Iterator[Curve]:
    """The error of each new estimate, at the second of its frame."""
    estimate, seen_at = signals.get(thing), signals.get(f"{thing}.seen_at")
    if estimate is None or seen_at is None:
        return
    new = np.flatnonzero(np.isfinite(seen_at) & (np.diff(seen_at, prepend=np.nan) != 0.0))
    if not len(new):
        return
    t, truth = seen_at[new].astype(float), positions(signals[f"{thing}_true"])
    there = np.column_stack([np.interp(t, signals["t"], truth[:, axis]) for axis in range(3)])
    error = np.linalg.norm(positions(estimate)[new] - there, axis=1)
    covariance = signals.get(f"{thing}.covariance")
    region = None if covariance is None else 1e3 * half_axes(covariance[new])
    yield Curve(thing, t, 1e3 * error, dots=True, region=region)


def half_axes(covariance: FloatArray) -> FloatArray:
    """The longest half axis (N,) in m of each 95 % region of position, by upper triangles (N, 21) of covariances."""
    matrices = np.zeros((len(covariance), 6, 6))
    rows, columns = np.triu_indices(6)
    matrices[:, rows, columns] = matrices[:, columns, rows] = covariance
    largest = np.linalg.eigvalsh(np.nan_to_num(matrices[:, :3, :3]))[:, -1]
    return np.sqrt(CHI2_95 * np.maximum(largest, 0.0))


def _curve(name: str, signals: Signals, values: FloatArray, peaks: bool = False) -> Curve:
    """The curve with at most `MAX_SAMPLES` samples; of `peaks` the largest value in each step is kept."""
    t, step = signals["t"].astype(float), max(1, -(-len(values) // MAX_SAMPLES))
    values = values.astype(float)
    if step > 1:
        whole = len(values) // step * step
        parts = values[:whole].reshape(-1, step)
        values = parts.max(axis=1) if peaks else parts[:, -1]
        t = t[step - 1 : whole : step]
    return Curve(name, t, values)


def readable(made: list[Panel]) -> list[dict[str, Any]]:
    """The panels' values for a script that tells them at a moment."""
    return [
        {"unit": panel.unit, "curves": [{"name": curve.name, **_numbers(curve)} for curve in panel.curves]}
        for panel in made
    ]


def _numbers(curve: Curve) -> dict[str, list[float | None]]:
    values = [None if np.isnan(value) else float(f"{value:.3g}") for value in curve.values]
    return {"t": [round(float(t), 2) for t in curve.t], "v": values}
