"""The leaf classes that a tree file may name: those of every task, and the sets that packages install.

A set is an entry point of the group `regrasp.leaves`: a mapping of names to classes. One that bears a task's name holds
the leaves of that task; any other set is for every task.
"""

from collections.abc import Mapping
from functools import cache
from typing import Any

from regrasp.behaviors.common import LEAVES as COMMON
from regrasp.interfaces.plugins import installed, load

GROUP = "regrasp.leaves"


@cache
def leaf_set(name: str) -> Mapping[str, type[Any]]:
    """The leaf classes of the set of that name. Raises what its import raises."""
    classes: Mapping[str, type[Any]] = load(GROUP, name)
    return classes


@cache
def all_leaves() -> dict[str, type[Any]]:
    """Every leaf class by its name in a tree file. A set that cannot be imported is left out."""
    found: dict[str, type[Any]] = {}
    for name in sorted(installed(GROUP)):
        try:
            found |= leaf_set(name)
        except Exception:
            continue
    return dict(sorted((found | COMMON).items()))


@cache
def owners() -> dict[str, str]:
    """The set that each leaf comes from, by the leaf's name; leaves of every task are not among them."""
    return {leaf: name for name in sorted(installed(GROUP)) for leaf in _names(name)}


def _names(name: str) -> list[str]:
    try:
        return [leaf for leaf in leaf_set(name) if leaf not in COMMON]
    except Exception:
        return []
