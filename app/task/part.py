"""A part of a task, named by its place and imported when it is asked for."""

from importlib import import_module
from typing import Any, Generic, TypeVar

from regrasp.app.files.findings import Finding, Findings

T = TypeVar("T")
NOTHING: tuple[Any, ...] = ()


class Part(Generic[T]):
    """A part of a task that is imported when it is asked for. `at` is "module:attribute"."""

    def __init__(self, at: str) -> None:
        self.at = at

    def __call__(self) -> T:
        """The part itself. Raises `Findings` if it cannot be imported."""
        module, _, attribute = self.at.partition(":")
        try:
            part: T = getattr(import_module(module), attribute)
        except (Exception, SystemExit) as error:  # another package's code: whatever it raises
            message = f"this part of a task cannot be loaded: {type(error).__name__}: {error}; mend its package"
            raise Findings([Finding(self.at, 0, message)]) from error
        return part
