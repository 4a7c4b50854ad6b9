"""The time line of a run as SVG: phases, marks of what happened, and a lane for each leaf."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from regrasp.app.report.charts import LEFT, RIGHT
from regrasp.app.report.course import Bar, Lane, Mark
from regrasp.interfaces.quote import cut
from regrasp.trees.export.text_width import shortened

LANE, FONT = 19.0, 11.0  # px: of a lane's height, and of its letters
KINDS = ("failed", "truth", "warning", "fault", "plan", "look", "note")  # in the order of their rows
KIND_WORDS = {
    "failed": "failures, touches",
    "truth": "ground truth",
    "warning": "noticed",
    "fault": "faults put in",
    "plan": "plans",
    "look": "looks",
    "note": "other events",
}


@dataclass(frozen=True)
class Box:
    """A bar as it is drawn: place and width in px, how the attempt ended, its words, and its tooltip."""

    x: float
    y: float
    width: float
    status: str
    words: str
    title: str
    t: float


@dataclass(frozen=True)
class Sign:
    """A mark as it is drawn."""

    x: float
    y: float
    kind: str
    title: str
    t: float


@dataclass(frozen=True)
class Row:
    """A row's name and the middle of its height."""

    name: str
    y: float
    path: str = ""


@dataclass(frozen=True)
class TimeLine:
    """All that the template draws, in px; `ticks` are the seconds of the axis and their places."""

    height: float
    left: float
    right: float
    rows: tuple[Row, ...]
    phases: tuple[Box, ...]
    boxes: tuple[Box, ...]
    signs: tuple[Sign, ...]
    ticks: tuple[tuple[float, str], ...]
    parts: tuple[float, ...]  # heights of lines between phases, marks and leaves


def time_line(phase: Lane, marks: Sequence[Mark], lanes: Sequence[Lane], end: float) -> TimeLine:
    """The time line from 0 to `end` s."""
    span = max(end, 0.1)
    rows: list[Row] = []
    y = 0.0

    def place(t: float) -> float:
        return round(LEFT + (RIGHT - LEFT) * min(max(t / span, 0.0), 1.0), 1)

    def row(name: str, path: str = "") -> float:
        nonlocal y
        y += LANE
        rows.append(Row(shortened(name, FONT, LEFT - 14), y - LANE / 2, path))
        return y - LANE

    at = row("phase")
    phases = tuple(_box(bar, at, place) for bar in phase.bars)
    parts = [y]
    signs: list[Sign] = []
    for kind in KINDS:
        if own := [mark for mark in marks if mark.kind == kind]:
            at = row(KIND_WORDS[kind])
            signs += [Sign(place(m.t), at + LANE / 2, kind, cut(f"{m.t:.2f} s  {m.text}", 300), m.t) for m in own]
    parts.append(y)
    boxes = [_box(bar, row_at, place) for lane in lanes for row_at in [row(lane.name, lane.path)] for bar in lane.bars]
    ticks = tuple((place(t), f"{t:g}") for t in _ticks(span))
    return TimeLine(y, LEFT, RIGHT, tuple(rows), phases, tuple(boxes), tuple(signs), ticks, tuple(parts))


def _box(bar: Bar, y: float, place: Callable[[float], float]) -> Box:
    x, width = place(bar.start), round(max(place(bar.end) - place(bar.start), 1.5), 1)
    words = shortened(bar.title, FONT, width - 8) if not bar.status and width > 30 else ""
    return Box(x, y, width, bar.status, words, cut(bar.title, 400), bar.start)


def _ticks(span: float) -> list[float]:
    """Round seconds along the axis, 5 to 11 of them."""
    step = 0.01
    for factor in (2, 2.5, 2) * 6:
        if span / step <= 10:
            break
        step *= factor
    return [round(step * number, 6) for number in range(int(span / step + 1e-9) + 1)]
