"""The charts of a campaign: shares with intervals, and distributions."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup

from regrasp.app.campaigns.figures import CaseFigures
from regrasp.app.report.charts import WIDTH, as_svg, drawn, label_text
from regrasp.app.report.colours import BLUE, MUTED, RED
from regrasp.app.report.figures_of_runs import Figure
from regrasp.app.report.knobs import Knob
from regrasp.app.run.batch import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ROW, MARGIN = 22.0, 46.0  # px: a case's height, and the axis below
MAX_CASES, COLUMNS = 40, 3
CELL = 190.0  # px: a small chart's height
BINS = 24


def case_chart(cases: Sequence[CaseFigures]) -> Markup:
    """The share as expected of each case, with its interval; of many cases those with the lowest shares."""
    chosen = sorted(cases, key=lambda case: case.succeeded / max(case.runs, 1))[:MAX_CASES]
    shown = [case for case in cases if case in chosen]
    height = len(shown) * ROW + MARGIN
    with drawn(WIDTH, height) as figure:
        axes = figure.add_axes((0.34, (MARGIN - 6) / height, 0.58, len(shown) * ROW / height))
        for number, case in enumerate(shown):
            _interval(axes, number, case.succeeded, case.runs, case.interval)
        axes.set_yticks(range(len(shown)), _names(shown))
        axes.set_ylim(len(shown) - 0.5, -0.5)
        axes.set_xlim(0, 101)
        axes.set_xlabel("runs as expected (%), with the 95 % interval")
        axes.grid(visible=False, axis="y")
        axes.tick_params(axis="y", length=0)
        words = "; ".join(f"{case.case}: {case.succeeded} of {case.runs}" for case in shown[:12])
        return as_svg(figure, f"Share of runs as expected, by case. {words}")


def _names(cases: Sequence[CaseFigures]) -> list[str]:
    """The cases' names, without the scenario's where all have the same."""
    scenarios = {case.case.partition(" ")[0] for case in cases}
    told = [case.case.partition(" ")[2] if len(scenarios) == 1 else case.case for case in cases]
    return [label_text(name, 50) for name in told]


def _interval(axes: "Axes", y: float, succeeded: int, runs: int, interval: tuple[float, float]) -> None:
    low, high = (100 * end for end in interval)
    axes.plot([low, high], [y, y], color=BLUE, lw=4, alpha=0.45, solid_capstyle="butt")
    axes.plot([100 * succeeded / max(runs, 1)], [y], marker="o", ms=5, color=BLUE, mec=BLUE)
    axes.text(102.5, y, f"{succeeded}/{runs}", va="center", fontsize=10, color=MUTED)


def distribution_chart(found: Sequence[Figure], rows: Sequence[Row]) -> Markup:
    """A histogram of each figure; runs that were not as expected stand on the others."""
    from matplotlib.ticker import MaxNLocator  # late, as all of matplotlib

    lines = -(-len(found) // COLUMNS)
    height = lines * CELL
    with drawn(WIDTH, height) as figure:
        for number, one in enumerate(found):
            axes = figure.add_axes(_cell(number, height))
            parts = [[v for place, v in one.values.items() if rows[place].succeeded is met] for met in (True, False)]
            edges = np.histogram_bin_edges([*one.values.values()], min(BINS, max(5, len(one.values) // 3))).tolist()
            axes.hist(parts, edges, stacked=True, color=[BLUE, RED], label=["as expected", "not as expected"])
            _hatch(axes)
            axes.set_xlabel(label_text(one.name, 44))
            if number % COLUMNS == 0:
                axes.set_ylabel("runs")
            if number == 0 and any(parts[1]):
                axes.legend(
                    frameon=False, fontsize=9, labelcolor=MUTED, loc="lower left", bbox_to_anchor=(0, 1), ncols=2
                )
            axes.yaxis.set_major_locator(MaxNLocator(4, integer=True))
            axes.xaxis.set_major_locator(MaxNLocator(5))
        return as_svg(figure, f"Distributions over the runs: {', '.join(one.name for one in found)}")


def _hatch(axes: "Axes") -> None:
    """The failed part with a dark edge, so that colour is not all that tells the two apart."""
    from matplotlib.patches import Rectangle

    for patch in axes.patches[len(axes.patches) // 2 :]:
        assert isinstance(patch, Rectangle)
        patch.set_edgecolor("#172033")
        patch.set_linewidth(0.8 if patch.get_height() else 0.0)


def knob_chart(knobs: Sequence[Knob]) -> Markup:
    """The share as expected at each value of each knob, with its interval."""
    lines = -(-len(knobs) // COLUMNS)
    height = lines * CELL
    with drawn(WIDTH, height) as figure:
        for number, knob in enumerate(knobs):
            axes = figure.add_axes(_cell(number, height))
            for place, one in enumerate(knob.settings):
                low, high = (100 * end for end in one.interval)
                axes.plot([place, place], [low, high], color=BLUE, lw=4, alpha=0.45, solid_capstyle="butt")
                axes.plot([place], [100 * one.succeeded / one.runs], marker="o", ms=4.5, color=BLUE, mec=BLUE)
            labels = [label_text(one.value, 23) for one in knob.settings]
            long = sum(map(len, labels)) > 30
            axes.set_xticks(range(len(labels)), labels, rotation=25 if long else 0, ha="right" if long else "center")
            axes.tick_params(axis="x", labelsize=9)
            axes.set_xlim(-0.6, len(labels) - 0.4)
            axes.set_ylim(0, 103)
            axes.set_title(label_text(knob.name, 44), fontsize=11, fontweight="bold", loc="left")
            axes.grid(visible=False, axis="x")
            if number % COLUMNS == 0:
                axes.set_ylabel("as expected (%)")
        return as_svg(figure, f"Share of runs as expected against {', '.join(knob.name for knob in knobs)}")


def _cell(number: int, height: float) -> tuple[float, float, float, float]:
    """The place of a small chart in a figure of that height: left, bottom, width, height as fractions."""
    line, column = divmod(number, COLUMNS)
    return (60 + 325 * column) / WIDTH, 1 - (line * CELL + CELL - 52) / height, 270 / WIDTH, (CELL - 82) / height
