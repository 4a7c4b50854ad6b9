"""Parts that other packages put in: the entry points of a group, imported one at a time.

https://packaging.python.org/en/latest/specifications/entry-points/
"""

from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any


@cache
def installed(group: str) -> dict[str, EntryPoint]:
    """The entry points of a group by their names; none is imported."""
    return {point.name: point for point in entry_points(group=group)}


def load(group: str, name: str) -> Any:
    """Import the entry point of that name. Raises KeyError without one, and whatever its import raises."""
    return installed(group)[name].load()
