"""Charts by matplotlib, as SVG that a page may hold: no styles, no script, texts as texts, colours of `colours`."""

import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from markupsafe import Markup, escape

from regrasp.app.report.colours import GRID, INK, MUTED, SERIES
from regrasp.app.report.curves import Curve, Panel
from regrasp.interfaces.quote import cut, printable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH, LEFT, RIGHT = 1000, 170, 980  # px: of a chart, and where its time axis begins and ends
PANEL_HEIGHT, HEAD, FOOT = 84, 34, 34  # px: of the curves, above and below them
_DPI = 72.0  # a px of the page is a point of matplotlib
_DASHES = ("-", (0, (5, 1.5)), (0, (1.5, 1.5)), (0, (6, 1.5, 1.5, 1.5)))  # so that colour is not all that tells curves
_STYLE: Any = {
    "svg.fonttype": "none",
    "svg.hashsalt": "regrasp",
    "font.family": "sans-serif",
    "font.size": 11.0,
    "text.color": INK,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": MUTED,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.8,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelsize": 10.0,
    "ytick.labelsize": 10.0,
    "text.parse_math": False,  # texts stem from files
    "figure.dpi": _DPI,
    "savefig.dpi": _DPI,
}


@contextmanager
def drawn(width: float, height: float) -> Iterator["Figure"]:
    """A new figure of that size in px, in the reports' style."""
    import matplotlib as mpl  # late: it takes half a second
    from matplotlib.figure import Figure

    with mpl.rc_context(_STYLE):
        yield Figure(figsize=(width / _DPI, height / _DPI), facecolor="none")


def as_svg(figure: "Figure", label: str) -> Markup:
    """The figure for a page whose policy forbids styles; `label` says to a screen reader what it shows."""
    text = io.StringIO()
    nothing = dict.fromkeys(("Date", "Creator", "Format", "Type"))
    figure.savefig(text, format="svg", metadata=nothing, transparent=True)
    drawn_part = text.getvalue().partition("<svg ")[2]
    size = re.search(r'viewBox="([^"]+)"', drawn_part)
    assert size is not None
    inner = drawn_part.partition(">")[2]
    for unwanted in (r"<metadata>.*?</metadata>", r"<style[^>]*>.*?</style>", r"<!--.*?-->"):
        inner = re.sub(unwanted, "", inner, flags=re.DOTALL)
    inner = re.sub(r' style="([^"]*)"', lambda found: _attributes(found[1]), inner)
    used = {*re.findall(r'(?:url\(|href=")#([\w-]+)', inner)}
    inner = re.sub(r' id="([^"]*)"', lambda found: found[0] if found[1] in used else "", inner)
    inner = re.sub(r"\s*\n\s*", "\n", inner)
    return Markup(
        f'<svg class="chart" viewBox="{size[1]}" role="img" aria-label="{escape(label_text(label, 600))}">{inner}'
    )


def label_text(text: str, most: int) -> str:
    """A text that may stem from a file, of at most so many characters."""
    return cut(printable(text), most)


def _attributes(style: str) -> str:
    """A style as attributes of SVG; a font's family is left to the page."""
    pairs = [part.partition(":")[::2] for part in style.split(";") if ":" in part]
    told = {name.strip(): value.strip() for name, value in pairs}
    font = told.pop("font", "")
    if size := re.search(r"([\d.]+)px", font):
        told["font-size"] = size[1]
        if re.search(r"\b(bold|[6-9]00)\b", font):
            told["font-weight"] = "600"
    told.pop("font-family", None)
    return "".join(f' {name}="{value}"' for name, value in told.items())


def curve_chart(panels: Sequence[Panel], end: float) -> Markup:
    """The panels below one another over simulated time from 0 to `end` s."""
    height = len(panels) * (PANEL_HEIGHT + HEAD) + FOOT
    with drawn(WIDTH, height) as figure:
        for number, panel in enumerate(panels):
            top = (number + 1) * (PANEL_HEIGHT + HEAD)
            place = (LEFT / WIDTH, 1 - top / height, (RIGHT - LEFT) / WIDTH, PANEL_HEIGHT / height)
            axes = figure.add_axes(place)
            _draw_panel(axes, panel)
            axes.set_xlim(0.0, max(end, 0.1))
            axes.tick_params(labelbottom=number == len(panels) - 1, length=3)
        axes.set_xlabel("simulated time (s)")
        titles = ", ".join(f"{panel.title} in {panel.unit}" for panel in panels)
        return as_svg(figure, f"Curves over simulated time: {titles}")


def _draw_panel(axes: "Axes", panel: Panel) -> None:
    axes.set_ylabel(panel.unit, rotation=0, ha="right", va="center", labelpad=8)
    axes.text(
        0.0, 1.1, label_text(panel.title, 80), transform=axes.transAxes, fontsize=12, fontweight="bold", va="bottom"
    )
    for number, curve in enumerate(panel.curves):
        _draw_curve(axes, curve, SERIES[number % len(SERIES)], _DASHES[number % len(_DASHES)])
    axes.set_ylim(bottom=0.0)
    axes.yaxis.set_major_locator(_few_steps())
    axes.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 1.02),
        ncols=4,
        frameon=False,
        fontsize=10,
        labelcolor=MUTED,
        borderaxespad=0.0,
        handlelength=2.2,
        columnspacing=1.4,
    )


def _draw_curve(axes: "Axes", curve: Curve, colour: str, dash: Any) -> None:
    if curve.region is not None:
        axes.vlines(curve.t, 0.0, curve.region, color=colour, alpha=0.25, lw=3, label="95 % region")
    if curve.dots:
        axes.plot(
            curve.t,
            curve.values,
            ls="none",
            marker="o",
            ms=3,
            color=colour,
            mec=colour,
            label=label_text(curve.name, 50),
        )
    else:
        axes.plot(curve.t, curve.values, color=colour, lw=1.5, ls=dash, label=label_text(curve.name, 50))


def _few_steps() -> Any:
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(nbins=3, min_n_ticks=2)
