"""Puts leaves of a test in place of those that are installed."""

from collections.abc import Callable, Mapping
from typing import Any

from regrasp.behaviors.registry import Leaves

Set = Callable[[str, Any], None]


def put_in(leaves: Mapping[str, type[Any]], setattr_: Set) -> None:
    """Let tree files name these leaves only; `setattr_` sets an attribute by its dotted path, as monkeypatch does."""
    found = Leaves(leaves)
    for name in ("leaves_of", "leaves_for"):
        setattr_(f"regrasp.behaviors.registry.{name}", lambda *_, **__: found)
