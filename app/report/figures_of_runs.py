"""Numbers of each run of a campaign: their names, their spread, and which runs lie far from the others."""

import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from regrasp.app.run.batch import Row

MAX_FIGURES = 12  # of what a task measures; choice: more are not looked at
SPREAD = 1.4826  # a normal distribution's standard deviation over its median absolute deviation
STRANGE = 3.5  # robust standard deviations from the median, as of Iglewicz and Hoaglin 1993
OWN = {
    "sim_seconds": "simulated time (s)",
    "wall_seconds": "time on the wall (s)",
    "longest_tick": "longest tick on the wall (s)",
    "unintended_force": "unintended force (N)",
}


@dataclass(frozen=True)
class Figure:
    """A number that runs have: its name with the unit, and its value by the run's place among the rows."""

    name: str
    values: Mapping[int, float]
    of_task: bool


def figures(rows: Sequence[Row], unit: Callable[[str], str] = lambda name: "") -> list[Figure]:
    """The numbers that differ between runs; a run whose process died has no times.

    `unit` tells that of what a task measures, '' for none.
    """
    found: dict[str, dict[int, float]] = {name: {} for name in OWN}
    for place, row in enumerate(rows):
        for name, own in found.items():
            value = getattr(row, name)
            if isinstance(value, (int, float)) and row.wall_seconds:
                own[place] = float(value)
    made = [Figure(OWN[name], values, of_task=False) for name, values in found.items()]
    made += [Figure(_with_unit(name, unit), values, of_task=True) for name, values in _measured(rows).items()][
        :MAX_FIGURES
    ]
    return [one for one in made if len({*one.values.values()}) > 1]


def _with_unit(name: str, unit: Callable[[str], str]) -> str:
    symbol = unit(name.rpartition(".")[2])
    return f"{name} ({symbol})" if symbol else name


def _measured(rows: Sequence[Row]) -> dict[str, dict[int, float]]:
    found: dict[str, dict[int, float]] = {}
    for place, row in enumerate(rows):
        for name, value in _numbers(row.measured):
            found.setdefault(name, {})[place] = value
    return found


def _numbers(measured: object, name: str = "") -> Iterator[tuple[str, float]]:
    """The numbers in what a task measured, by their keys; of a list its length and its items' largest."""
    if isinstance(measured, dict):
        for key, value in measured.items():
            yield from _numbers(value, f"{name}.{key}" if name else str(key))
    elif isinstance(measured, list):
        yield f"number of {name}", float(len(measured))
    elif isinstance(measured, (int, float)) and not isinstance(measured, bool):
        yield name, float(measured)


@dataclass(frozen=True)
class Strange:
    """A run that lies far from the others: its place among the rows, in which figure, its value and their median."""

    place: int
    name: str
    value: float
    median: float
    deviations: float


def strange(found: Sequence[Figure], most: int = 8) -> list[Strange]:
    """The runs that lie farthest from the median in any figure, each once; times on the wall say nothing of a robot."""
    worst: dict[int, Strange] = {}
    for figure in found:
        if "on the wall" in figure.name:
            continue
        middle = statistics.median(figure.values.values())
        spread = SPREAD * statistics.median(abs(value - middle) for value in figure.values.values())
        if spread <= 0.0:
            continue
        for place, value in figure.values.items():
            far = abs(value - middle) / spread
            if far > STRANGE and (place not in worst or far > worst[place].deviations):
                worst[place] = Strange(place, figure.name, value, middle, far)
    return sorted(worst.values(), key=lambda one: (-one.deviations, one.place))[:most]
