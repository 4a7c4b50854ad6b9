"""Parts that other packages put in: the entry points of a group, imported one at a time.

https://packaging.python.org/en/latest/specifications/entry-points/
"""

from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any


class PluginError(Exception):
    """A part that a package puts in cannot be had; the message says why."""


@cache
def installed(group: str) -> dict[str, tuple[EntryPoint, ...]]:
    """The entry points of a group by their names, in the order of the names; none is imported.

    A name has several entry points if packages put in different things under it.
    """
    found: dict[str, dict[str, EntryPoint]] = {}
    for point in entry_points(group=group):
        found.setdefault(point.name, {}).setdefault(point.value, point)
    return {name: tuple(found[name].values()) for name in sorted(found)}


def load(group: str, name: str) -> Any:
    """Import the entry point of that name.

    Raises:
        PluginError: there is none, or there are several, or its import fails.
    """
    points = installed(group).get(name, ())
    if len(points) != 1:
        packages = " and ".join(point.dist.name if point.dist else point.value for point in points)
        many = f"{len(points)} packages put it in, {packages}; remove all but one"
        raise PluginError(many if points else f"no package has the entry point {name} in the group {group}")
    try:
        return points[0].load()
    except (Exception, SystemExit) as error:  # another package's code: whatever it raises
        raise PluginError(f"{type(error).__name__}: {error}") from error
