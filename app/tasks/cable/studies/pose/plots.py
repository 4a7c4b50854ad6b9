"""Plots of the pose study: each trial's error by configuration, and the shares identified and grasped."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from regrasp.app.campaigns.statistics import wilson_interval
from regrasp.app.tasks.cable.studies.pose.scenes import CONFIGURATIONS, HEADLINE
from regrasp.app.tasks.cable.studies.pose.trial import Trial

# Hwang 2024, table 5: mean error in mm of the RGB-D technique by the share hidden, in its configurations 3 and 6 to 9.
THESIS_RGBD = {"3": 4.4, "6": 8.8, "7": 13.6, "8": 17.0, "9": 35.7}
_GROUP_WIDTH = 0.8  # of the distance between two configurations or bars


def write_plots(folder: Path, trials: Sequence[Trial], techniques: Sequence[str], thesis: Mapping[str, Any]) -> None:
    """Write errors.png and shares.png to `folder`; `thesis` holds the same as `thesis` in pose.json."""
    _errors(trials, techniques).savefig(folder / "errors.png", dpi=120)
    _shares(trials, techniques, thesis).savefig(folder / "shares.png", dpi=120)


def _errors(trials: Sequence[Trial], techniques: Sequence[str]) -> Figure:
    figure = Figure(figsize=(10, 5), layout="constrained")
    axes = figure.add_subplot()
    present = {t.configuration for t in trials}
    names = [c for c in CONFIGURATIONS if c in present]
    for number, technique in enumerate(techniques):
        shift = _GROUP_WIDTH * ((number + 0.5) / len(techniques) - 0.5)
        points = [
            (names.index(t.configuration) + shift, 1e3 * t.error_m)
            for t in trials
            if t.technique == technique and t.error_m is not None
        ]
        x, y = np.array(points).reshape(-1, 2).T
        axes.plot(x, y, "o", alpha=0.5, markersize=4, label=technique)
    shown = [c for c in THESIS_RGBD if c in names]
    if shown:
        axes.plot([names.index(c) for c in shown], [THESIS_RGBD[c] for c in shown], "k_", ms=20, label="thesis, RGB-D")
    axes.set_xticks(range(len(names)), [_label(name) for name in names])
    axes.set(
        xlabel="configuration, share hidden", ylabel="position error, mm", xlim=(-0.5, len(names) - 0.5), ylim=(0, None)
    )
    axes.grid(axis="y", alpha=0.3)
    axes.legend()
    return figure


def _label(name: str) -> str:
    hidden = CONFIGURATIONS[name].hidden
    return f"{name}\n{hidden:.0%}" if hidden else name


def _shares(trials: Sequence[Trial], techniques: Sequence[str], thesis: Mapping[str, Any]) -> Figure:
    figure = Figure(figsize=(8, 4), layout="constrained")
    first = next((name for name in techniques if name in thesis), None)
    for axes, what in zip(figure.subplots(1, 2, sharey=True), ("identified", "grasped"), strict=True):
        for number, technique in enumerate(techniques):
            own = [t for t in trials if t.technique == technique and t.configuration in HEADLINE]
            tried = [bool(getattr(t, what)) for t in own if getattr(t, what) is not None]
            if tried:
                k, n = sum(tried), len(tried)
                low, high = wilson_interval(k, n)
                axes.bar(
                    number, 100 * k / n, _GROUP_WIDTH, yerr=[[100 * (k / n - low)], [100 * (high - k / n)]], capsize=4
                )
            if technique in thesis:
                k, n = thesis[technique][what]
                axes.plot(number, 100 * k / n, "k_", markersize=40, label="thesis" if technique == first else None)
        axes.set_xticks(range(len(techniques)), [name.replace(", ", "\n") for name in techniques])
        axes.set(title=what, xlim=(-0.6, len(techniques) - 0.4), ylim=(0, 105))
        if first is not None:
            axes.legend(loc="lower right", markerscale=0.4)
    figure.axes[0].set_ylabel("share of trials, %")
    return figure
