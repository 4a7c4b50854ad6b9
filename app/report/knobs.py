"""What varies from scene to scene of a campaign, and how often the runs with each value came out as expected."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from regrasp.app.campaigns.statistics import wilson_interval
from regrasp.app.campaigns.store import StoredRow
from regrasp.app.records.result import DEFAULT_CASE
from regrasp.app.run.batch import Row

MAX_VALUES, BINS, MAX_KNOBS = 8, 5, 24  # numbers with more values are put into so many bins of equal counts


@dataclass(frozen=True)
class Setting:
    """A value of a knob, or a bin of values: how many runs had it, how many were as expected, and the interval."""

    value: str
    runs: int
    succeeded: int
    interval: tuple[float, float]


@dataclass(frozen=True)
class Knob:
    """Something that varies, and its settings in their order. `apart`: two intervals do not even touch."""

    name: str
    settings: tuple[Setting, ...]
    apart: bool


def knobs(rows: Sequence[Row], stored: Sequence[StoredRow]) -> list[Knob]:
    """The knobs that have two values or more, those that tell runs apart first."""
    values: dict[str, dict[int, str | float]] = {}
    for place, (row, one) in enumerate(zip(rows, stored, strict=True)):
        for name, value in _settings(row, one):
            values.setdefault(name, {})[place] = value
    made = [_knob(name, own, rows) for name, own in values.items() if len({*own.values()}) > 1]
    return sorted(made, key=lambda knob: (not knob.apart, knob.name))[:MAX_KNOBS]


def _settings(row: Row, stored: StoredRow) -> Iterator[tuple[str, str | float]]:
    """Name and value of each knob of a run: its scenario, what its case sets, what was set for it, what was drawn."""
    yield "scenario", row.scenario
    yield "gravity", row.gravity
    source = stored.value.get("source")
    source = source if isinstance(source, dict) else {}
    given = source.get("overrides", [])
    pairs = [*(row.case.split(",") if row.case != DEFAULT_CASE else []), *map(str, given)]
    for pair in pairs:
        name, equals, value = pair.partition("=")
        if equals and name not in ("seed", "gravity"):
            yield name.strip(), _number(value.strip())
    scene = source.get("scene")
    for name, drawn in scene.items() if isinstance(scene, dict) else ():
        if isinstance(drawn, (int, float)):
            yield f"drawn: {name}", float(drawn)


def _number(text: str) -> str | float:
    try:
        value = float(text)
    except ValueError:
        return text
    return value if math.isfinite(value) else text


def _knob(name: str, values: Mapping[int, str | float], rows: Sequence[Row]) -> Knob:
    groups = _groups(values)
    settings = tuple(_setting(label, [rows[place].succeeded for place in places]) for label, places in groups)
    apart = max(one.interval[0] for one in settings) > min(one.interval[1] for one in settings)
    return Knob(name, settings, apart)


def _setting(label: str, succeeded: Sequence[bool]) -> Setting:
    return Setting(label, len(succeeded), sum(succeeded), wilson_interval(sum(succeeded), len(succeeded)))


def _groups(values: Mapping[int, str | float]) -> list[tuple[str, list[int]]]:
    """The runs' places by value, in order; of many different numbers by bins that hold about equally many."""
    different = {*values.values()}
    numbers = {place: value for place, value in values.items() if isinstance(value, float)}
    if len(different) <= MAX_VALUES or len(numbers) < len(values):
        ordered = sorted(different, key=lambda value: (isinstance(value, str), value))[:MAX_KNOBS]
        return [(_label(value), [place for place, own in values.items() if own == value]) for value in ordered]
    places = sorted(numbers, key=numbers.__getitem__)
    parts = [places[len(places) * n // BINS : len(places) * (n + 1) // BINS] for n in range(BINS)]
    return [(f"{numbers[part[0]]:.3g} to {numbers[part[-1]]:.3g}", part) for part in parts if part]


def _label(value: str | float) -> str:
    return value if isinstance(value, str) else f"{value:g}"
