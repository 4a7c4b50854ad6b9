"""Expands a scenario's `vary`, lists and ranges of values, into named cases."""

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from pydantic import BaseModel

from regrasp.app.files.findings import Finding
from regrasp.app.files.overrides import Assignment
from regrasp.app.files.validation import read_as
from regrasp.app.files.yaml_lines import Document, Path, Place, Value
from regrasp.app.records.result import DEFAULT_CASE
from regrasp.app.scenario.schema import Steps, Vary
from regrasp.interfaces.quote import cut

MAX_CASES = 10_000


class _Varied(BaseModel):
    """The part of a scenario file that varies."""

    vary: Vary = {}


@dataclass(frozen=True)
class Axis:
    """A key that varies, and its values with their places in the file."""

    key: str
    values: Sequence[Document]

    def assignment(self, value: Document) -> Assignment:
        """The assignment of one of the values."""
        return Assignment(self.key, value, value.place(()), f"vary: {cut(self.key)}: ")


def axes(document: Document, overrides: Sequence[Assignment]) -> tuple[list[Axis], list[Finding]]:
    """The valid axes, in the file's order, and the findings of the others.

    A key that `overrides` set varies no more: it keeps that value. A key inside a value that they set is dropped.
    """
    written = keys(document)
    _, errors = read_as(document, _Varied)
    wrong = {error.path[1] for error in errors if len(error.path) > 1}
    wrong |= {path[1] for path in document.unread if path[:1] == ("vary",) and len(path) == 2}
    good = {key: value for key, value in written.items() if key not in wrong}
    found = []
    for key, spec in _Varied.model_validate_json(json.dumps({"vary": good}), strict=True).vary.items():
        fixed = [a for a in overrides if f"{key}.".startswith(f"{a.key}.")]
        if not fixed:
            found.append(Axis(key, _values(document, key, spec)))
        elif fixed[-1].key == key:
            found.append(Axis(key, [fixed[-1].new]))
    own = [error.finding for error in errors if error.path]  # that a file is no mapping is a finding elsewhere
    return found, [*own, *_problems(found, document.place(("vary",)))]


def keys(document: Document) -> dict[str, Value]:
    """The content of `vary` by key, valid or not."""
    vary = document.value.get("vary") if isinstance(document.value, dict) else None
    return vary if isinstance(vary, dict) else {}


def count(axes: Sequence[Axis]) -> int:
    """The number of cases."""
    return math.prod(len(axis.values) for axis in axes)


def expand(axes: Sequence[Axis]) -> Iterator[tuple[str, list[Assignment]]]:
    """Name and assignments of every case; the last key varies fastest.

    If there are more than `MAX_CASES`, only some that change a single key: enough to find what is wrong with values.
    """
    chosen = product(*(axis.values for axis in axes)) if count(axes) <= MAX_CASES else _one_by_one(axes)
    for values in chosen:
        given = list(zip(axes, values, strict=True))
        name = ",".join(f"{axis.key}={_text(value.value)}" for axis, value in given)
        yield name or DEFAULT_CASE, [axis.assignment(value) for axis, value in given]


def _values(document: Document, key: str, spec: Sequence[Value] | str | Steps) -> Sequence[Document]:
    path: Path = ("vary", key)
    if not isinstance(spec, str | Steps):
        return document.items(path)
    return [Document(number, {(): document.place(path)}) for number in _numbers(spec)]


def _numbers(spec: str | Steps) -> Sequence[int] | Sequence[float]:
    """The numbers of a range; of a range that is too long only the first `MAX_CASES` and the last."""
    if isinstance(spec, str):
        whole = range(*map(int, spec.split(":")))
        return whole if len(whole) <= MAX_CASES else [*whole[:MAX_CASES], whole[-1]]
    numbers = [float(f"{v:.12g}") for v in np.linspace(spec.first, spec.last, spec.steps)]
    return [int(v) for v in numbers] if all(v.is_integer() for v in numbers) else numbers


def _one_by_one(axes: Sequence[Axis]) -> Iterator[Sequence[Document]]:
    """The first values, then those in which a single key has another value: of a long list some from both ends."""
    first = [axis.values[0] for axis in axes]
    yield first
    for i, axis in enumerate(axes):
        for value in [*axis.values[1:50], *axis.values[50:][-50:]]:
            yield [*first[:i], value, *first[i + 1 :]]


def _problems(axes: Sequence[Axis], place: Place) -> Iterator[Finding]:
    """Findings of too many cases, and of values that stand twice."""
    if count(axes) > MAX_CASES:
        yield Finding(*place, f"vary makes more than {MAX_CASES} cases; shorten a list or a range")
    for axis in axes:
        seen: set[str] = set()
        for value in axis.values:
            if (text := _text(value.value)) in seen:
                yield Finding(*value.place(()), f"vary: {cut(axis.key)} takes {cut(text)} twice; keep one")
            seen.add(text)


def _text(value: Value) -> str:
    """A value in a case's name."""
    return value if isinstance(value, str) else json.dumps(value, separators=(",", ":"), ensure_ascii=False)
