"""Plots of an approach study, as the source's Figures 4-22 to 4-25."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from regrasp.app.tasks.printer.studies.approach_trial import Trial

_COLORS = {"one_step": "#E69F00", "two_step": "#56B4E9", "three_step": "#CC79A7", "servo": "#009E73"}  # Okabe and Ito's


def write_plots(trials: Sequence[Trial], out: Path) -> None:
    """Write errors.png, paths.png and time.png of the trials of block A, or of the first block, into a folder."""
    from matplotlib.figure import Figure  # late: it takes a second to import

    block = "A" if any(trial.block == "A" for trial in trials) else trials[0].block
    shown = [trial for trial in trials if trial.block == block]
    names = list(dict.fromkeys(trial.approach for trial in shown))
    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    for i, name in enumerate(names):
        errors = np.array([t.error for t in shown if t.approach == name and t.error is not None]).reshape(-1, 3)
        parts = np.abs(errors[:, 0]), np.linalg.norm(errors[:, 1:], axis=1), np.linalg.norm(errors, axis=1)
        means = [1e3 * float(part.mean()) if len(part) else 0.0 for part in parts]
        axes.bar(np.arange(3) + 0.8 * i / len(names), means, 0.75 / len(names), color=_COLORS[name], label=name)
    axes.set_xticks(np.arange(3) + 0.4 - 0.4 / len(names), ["X", "Y-Z", "X-Y-Z"])
    axes.set_ylabel("mean error, mm")
    axes.set_title(f"Error at the approach's end, block {block}")
    axes.legend()
    figure.savefig(out / "errors.png", dpi=120)

    first = min(trial.seed for trial in shown)
    figure = Figure(figsize=(7, 6), layout="constrained")
    space = figure.add_subplot(projection="3d")
    for trial in (trial for trial in shown if trial.seed == first and trial.path):
        _, x, y, z = np.array(trial.path).T
        space.plot(x, y, z, color=_COLORS[trial.approach], linewidth=1)
    space.set_xlabel("x, m from the goal")
    space.set_ylabel("y, m")
    space.set_zlabel("z, m")
    space.set_title(f"The tool's way, block {block}, seed {first}")
    figure.savefig(out / "paths.png", dpi=120)

    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    for trial in (trial for trial in shown if trial.seed == first and trial.path):
        seconds, *off = np.array(trial.path).T
        label = trial.approach if trial.start == shown[0].start else None
        millimeters = 1e3 * np.linalg.norm(off, axis=0)
        axes.semilogy(seconds, millimeters, color=_COLORS[trial.approach], linewidth=1, label=label)
    axes.set_xlabel("simulated s")
    axes.set_ylabel("error, mm")
    axes.set_title(f"Error over time, block {block}, seed {first}")
    axes.grid(alpha=0.3)
    axes.legend()
    figure.savefig(out / "time.png", dpi=120)
