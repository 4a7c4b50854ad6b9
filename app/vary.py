"""A scenario's `vary`: from lists and ranges to named cases."""

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from pydantic import BaseModel

from app.findings import Finding, Findings
from app.overrides import Assignment
from app.scenario_schema import Steps, Vary
from app.schema import validated
from app.yaml_lines import Document, Place, Value

MOST_CASES = 10_000
DEFAULT = "default"  # the name of the only case where nothing varies


class _Varied(BaseModel):
    """Of a scenario file only what varies."""

    vary: Vary = {}


@dataclass(frozen=True)
class Axis:
    """One key that varies, its values, and where they stand."""

    key: str
    values: Sequence[Value]
    place: Place

    def assignment(self, value: Value) -> Assignment:
        """One of the values for the key."""
        return Assignment(self.key, Document(value, {(): self.place}), f"vary: {self.key}", self.place)


def axes(document: Document, overrides: Sequence[Assignment]) -> list[Axis]:
    """What varies, in the file's order.

    A key that `overrides` set varies no more: it keeps that one value. One inside a value that they set is gone.
    Raises `Findings`: no valid `vary`, a value twice, or too many cases.
    """
    if not isinstance(document.value, dict):
        return []
    found = []
    for key, written in validated(document, _Varied).vary.items():
        fixed = [a for a in overrides if f"{key}.".startswith(f"{a.key}.")]
        if not fixed:
            found.append(Axis(key, _values(written), document.place(("vary", key))))
        elif fixed[-1].key == key:
            found.append(Axis(key, [fixed[-1].new.value], fixed[-1].place))
    _check(found, document.place(("vary",)))
    return found


def count(axes: Sequence[Axis]) -> int:
    """How many cases there are."""
    return math.prod(len(axis.values) for axis in axes)


def expand(axes: Sequence[Axis]) -> Iterator[tuple[str, list[Assignment]]]:
    """Name and assignments of every case, the last key varying fastest."""
    for values in product(*(axis.values for axis in axes)):
        chosen = list(zip(axes, values, strict=True))
        name = ",".join(f"{axis.key}={_text(value)}" for axis, value in chosen)
        yield name or DEFAULT, [axis.assignment(value) for axis, value in chosen]


def _values(written: Sequence[Value] | str | Steps) -> Sequence[Value]:
    if isinstance(written, str):
        return range(*map(int, written.split(":")))
    if isinstance(written, Steps):
        numbers = [float(f"{v:.12g}") for v in np.linspace(written.first, written.last, written.steps)]
        return [int(v) for v in numbers] if all(v.is_integer() for v in numbers) else numbers
    return written


def _check(axes: Sequence[Axis], place: Place) -> None:
    if count(axes) > MOST_CASES:
        message = f"vary makes {count(axes)} cases; shorten a list or a range, {MOST_CASES} are the most"
        raise Findings([Finding(*place, message)])
    found = []
    for axis in axes:
        texts = [_text(value) for value in axis.values]
        found += [
            Finding(*axis.place, f"vary: {axis.key} takes {text} twice; keep one")
            for i, text in enumerate(texts)
            if text in texts[:i]
        ]
    if found:
        raise Findings(found)


def _text(value: Value) -> str:
    """A value in a case's name."""
    return value if isinstance(value, str) else json.dumps(value, separators=(",", ":"), ensure_ascii=False)
