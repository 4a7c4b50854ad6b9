"""Signals of a run: values at each tick, as one row of numbers each; see RECORD.md beside this file."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.task.signals import Signal, SignalGroup
from regrasp.interfaces.arrays import FloatArray

FILE = "signals.f32"
SCHEMA = 1
_MAX_HEADER = 1 << 20  # bytes


class SignalWriter:
    """Writes the signals to a stream: a line of JSON that names them, then a row of float32 for each `sample`."""

    def __init__(self, stream: BinaryIO, groups: Sequence[SignalGroup], rate: float) -> None:
        self._stream, self._groups = stream, groups
        self._width = sum(signal.width for group in groups for signal in group.signals)
        signals = [asdict(signal) for group in groups for signal in group.signals]
        header = {"schema": SCHEMA, "rate": rate, "signals": signals}
        stream.write(json.dumps(header).encode() + b"\n")

    def sample(self) -> None:
        """Write a row. Raises ValueError if a group gives other than it says."""
        row = np.array([value for group in self._groups for value in group.sample()], "<f4")
        if len(row) != self._width:
            raise ValueError(f"{len(row)} values of signals, not {self._width}")
        self._stream.write(row.tobytes())


class Signals(Mapping[str, FloatArray]):
    """The signals of a record by name: arrays (N, width), or (N,) where the width is 1. `rate` is in Hz."""

    def __init__(self, rate: float, described: Sequence[Signal], rows: FloatArray) -> None:
        self.rate, self.described = rate, tuple(described)
        ends = np.cumsum([signal.width for signal in described])
        parts = np.split(rows, ends[:-1], axis=1) if described else []
        self._values = {
            signal.name: part[:, 0] if signal.width == 1 else part
            for signal, part in zip(described, parts, strict=True)
        }

    def __getitem__(self, name: str) -> FloatArray:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)


def read_signals(path: Path) -> Signals:
    """Read a file of signals; a row that was cut off by a kill is left out. Raises `Findings`."""
    try:
        with path.open("rb") as stream:
            first, rest = stream.readline(_MAX_HEADER), stream.read()
    except OSError as error:
        raise Findings([Finding(shown(path), 0, f"cannot be read: {error.strerror}")]) from None
    try:
        header: dict[str, Any] = json.loads(first)
        schema, rate = int(header["schema"]), float(header["rate"])
        described = [Signal(**signal) for signal in header["signals"]]
        width = sum(signal.width for signal in described)
        if width < 1 or any(signal.width < 1 for signal in described):
            raise ValueError("signals without columns")
    except (ValueError, KeyError, TypeError) as error:
        raise Findings([Finding(shown(path), 1, f"no signals of a run: {error}")]) from None
    if schema > SCHEMA:
        message = f"schema {schema} is newer than {SCHEMA}, which this program reads; take a newer Regrasp"
        raise Findings([Finding(shown(path), 1, message)])
    whole = len(rest) // (4 * width)
    rows = np.frombuffer(rest, "<f4", whole * width).reshape(whole, width)
    return Signals(rate, described, rows)
