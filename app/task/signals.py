"""Signals: numbers that a task adds to each row of a record's signals."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Signal:
    """What some columns mean: the name, the unit, how many columns, and a sentence."""

    name: str
    unit: str
    width: int
    about: str


@dataclass(frozen=True)
class SignalGroup:
    """Signals that are sampled together. `sample` gives their numbers in order; NaN is not known."""

    signals: tuple[Signal, ...]
    sample: Callable[[], Sequence[float]]


def no_signals(_world: Any, _services: Any) -> tuple[SignalGroup, ...]:
    """Of a task that adds none."""
    return ()
