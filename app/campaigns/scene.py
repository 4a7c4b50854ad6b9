"""What a run's seed drew of its scene, as numbers for its row: they tell what decides how runs come out."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

from regrasp.app.scenario.load import Scenario

_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # ten times as fast, where it is there
MAX_NUMBERS = 40


def drawn_numbers(scenario: Scenario, record: Path | None) -> dict[str, float]:
    """By dotted keys the numbers in a record's scenario and cell that are not the scenario's own; {} without a draw.

    Of obstacles there are how many, and the largest height in m.
    """
    if scenario.file.draw is None or record is None:
        return {}
    try:
        drawn, cell = (_read(record / name) for name in ("scenario.yaml", "cell.yaml"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError):
        return {}
    obstacles = [one for one in drawn.get("obstacles") or () if isinstance(one, dict)]
    found = {"obstacles": float(len(obstacles))}
    if obstacles:
        found["highest obstacle (m)"] = max(float(one["size"][2]) for one in obstacles)
    own = dict(_numbers(scenario.file.model_dump(mode="json")))
    found |= {name: value for name, value in _numbers(drawn) if own.get(name) != value and name != "seed"}
    own = dict(_numbers(scenario.cell.model_dump(mode="json")))
    found |= {name: value for name, value in _numbers(cell) if name in own and own[name] != value}
    return dict([*found.items()][:MAX_NUMBERS])


def _read(path: Path) -> dict[str, Any]:
    value = yaml.load(path.read_text(encoding="utf-8"), Loader=_LOADER)
    return value if isinstance(value, dict) else {}


def _numbers(values: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, float]]:
    """The numbers by their dotted keys; lists are left out."""
    for key, value in values.items():
        if isinstance(value, dict):
            yield from _numbers(value, f"{above}{key}.")
        elif isinstance(value, (int, float)) and not isinstance(value, bool):
            yield f"{above}{key}", float(value)
