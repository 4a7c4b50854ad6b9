"""Where the wall-clock time of runs goes, part by part, against the time in PyBullet's `stepSimulation`."""

import statistics
from collections.abc import Sequence
from typing import get_args

from regrasp.app.run.batch import Row
from regrasp.interfaces.wall_time import Part

PARTS_HEADER = ("part", "ms per simulated s", "x physics", "floor")

# What a part would take at least, in times of the physics: estimated from profiles of a whole run, with all that is
# computed twice or for nobody left out.
_FLOORS = {
    "physics": 1.0,
    "step loop": 0.23,
    "rendering": 0.40,
    "perception": 0.34,
    "planning": 0.18,
    "start": 0.07,
    "tree": 0.03,
    "record": 0.02,
}


def part_lines(rows: Sequence[Row]) -> list[tuple[str, ...]]:
    """The lines below `PARTS_HEADER`: medians over the runs that have them, the whole run last."""
    timed = [row for row in rows if row.wall_by_part.get("physics") and row.sim_seconds]
    lines = [_line(part, timed) for part in get_args(Part) if any(part in row.wall_by_part for row in timed)]
    return [*lines, _line("whole run", timed)] if timed else []


def _line(part: str, rows: Sequence[Row]) -> tuple[str, ...]:
    seconds = [_seconds(row, part) for row in rows]
    each = [1e3 * spent / row.sim_seconds for spent, row in zip(seconds, rows, strict=True)]
    ratios = [spent / row.wall_by_part["physics"] for spent, row in zip(seconds, rows, strict=True)]
    floor = sum(_FLOORS.values()) if part == "whole run" else _FLOORS.get(part)
    return (
        part,
        f"{statistics.median(each):.0f}",
        f"{statistics.median(ratios):.2f}",
        "-" if floor is None else f"{floor:.2f}",
    )


def _seconds(row: Row, part: str) -> float:
    return sum(row.wall_by_part.values()) if part == "whole run" else row.wall_by_part.get(part, 0.0)
