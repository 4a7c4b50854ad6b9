"""A part of a task, named by its place and imported when it is asked for."""

from importlib import import_module
from typing import Any, Generic, TypeVar

T = TypeVar("T")
NOTHING: tuple[Any, ...] = ()


class Part(Generic[T]):
    """A part of a task that is imported when it is asked for. `at` is "module:attribute"."""

    def __init__(self, at: str) -> None:
        self._module, _, self._attribute = at.partition(":")

    def __call__(self) -> T:
        """The part itself."""
        part: T = getattr(import_module(self._module), self._attribute)
        return part
