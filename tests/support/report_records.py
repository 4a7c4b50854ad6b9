"""Records for the tests of reports: the toy record with signals, pictures, plans and texts that mean harm."""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from toy_record import write_record

from regrasp.app.records.signals import SignalWriter
from regrasp.app.task.signals import Signal, SignalGroup
from regrasp.interfaces.cause import Cause

HOSTILE = "<script>window.harm = 1</script>\"'`&amp;{{7*7}}\u202e\x1b[2J" + "x" * 10_000
SCENARIO = """\
description: The part is to be fetched.
faults:
- {type: jaw_opens, when: {at: [0.4, 0.6], node: null}, seconds: 1.0}
obstacles: [{name: block}]
"""
PLAN = {
    "because": "the task begins",
    "actions": "fetch turn",
    "state": {"lamp": "dark"},
    "network": ["light", "  fetch"],
}
AGAIN = {"because": "fetch failed", "actions": "search fetch turn", "state": {"lamp": "lit"}, "network": ["light"]}
SECONDS = 3.0


def rich_record(folder: Path, hostile: bool = False) -> Path:
    """A failed run with all that a report shows; `hostile`: texts in it try to become more than text."""
    changes: dict[str, Any] = {}
    if hostile:
        changes = {"case": HOSTILE, "cause": Cause("grasp_failed", HOSTILE, HOSTILE)}
    write_record(folder, **changes)
    words = HOSTILE if hostile else "The part is to be fetched."
    (folder / "scenario.yaml").write_text(SCENARIO.replace("The part is to be fetched.", json.dumps(words)))
    _add_events(folder, words)
    _add_signals(folder)
    (folder / "pictures").mkdir()
    for number, t in enumerate(("0000.50", "0001.50")):
        picture = np.full((48, 64, 3), 60 + 80 * number, np.uint8)
        cv2.imwrite(str(folder / f"pictures/{t}-rear-slip.jpg"), picture)
    return folder


def _add_events(folder: Path, words: str) -> None:
    path = folder / "events.jsonl"
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    more = [
        {"t": 0.0, "level": "info", "event": "planned", "node": "root", **PLAN},
        {"t": 1.0, "level": "info", "event": "planned", "node": "root", **AGAIN},
        {"t": 1.5, "level": "warning", "event": f"anomaly {words}", "node": words, "why": words},
    ]
    told = sorted([*lines, *more], key=lambda line: line["t"])
    path.write_text("".join(json.dumps(line) + "\n" for line in told))


def _add_signals(folder: Path) -> None:
    """Of one arm and of a thing that is seen twice, 5 mm off, once with a region of the right size."""
    seconds = iter(np.arange(0.0, SECONDS, 0.05))
    eye = np.hstack([np.eye(3), np.zeros((3, 1))])

    def sample() -> list[float]:
        t = float(next(seconds))
        hand, thing, seen = eye.copy(), eye.copy(), eye.copy()
        hand[0, 3], thing[:, 3], seen[:, 3] = 0.1 * t, (0.3, 0.0, 0.0), (0.305, 0.0, 0.0)
        covariance = np.eye(6)[np.triu_indices(6)] * 4e-6
        known = [0.5 if t < 1.5 else 1.5, *seen.ravel(), *covariance] if t >= 0.5 else [np.nan] * 34
        return [t, *[0.2 * t] * 6, *hand.ravel(), 0.05 - 0.01 * t, 4.0 * (t > 1.0), *thing.ravel(), *known]

    signals = (
        Signal("t", "s", 1, ""),
        Signal("right.joints", "rad", 6, ""),
        Signal("right.tool_true", "m", 12, ""),
        Signal("right.gap", "m", 1, ""),
        Signal("right.force_true", "N", 1, ""),
        Signal("thing_true", "m", 12, ""),
        Signal("thing.seen_at", "s", 1, ""),
        Signal("thing", "m", 12, ""),
        Signal("thing.covariance", "m2", 21, ""),
    )
    with (folder / "signals.f32").open("wb") as stream:
        writer = SignalWriter(stream, [SignalGroup(signals, sample)], 20.0)
        for _ in range(int(SECONDS * 20)):
            writer.sample()
