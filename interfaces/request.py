"""Work of a service that takes time, as the leaves poll it."""

from collections.abc import Callable, Generator, Iterator
from typing import Generic, TypeVar

from regrasp.interfaces.wall_time import Part, counts_as

T = TypeVar("T")


class RequestError(Exception):
    """A request cannot be done; `code` is the cause, the message says why, with numbers."""

    def __init__(self, code: str, message: str) -> None:
        super().__init__(message)
        self.code = code


class Request(Generic[T]):
    """Work under way; every `poll` does one step of it.

    `steps` yields where it waits for the next tick, and may return an answer. `cancel` calls `stop`. The steps' time
    counts as that of `part`.
    """

    _answer: T

    def __init__(
        self,
        steps: Generator[None, None, T] | Iterator[None],
        stop: Callable[[], None] = lambda: None,
        part: Part = "planning",
    ) -> None:
        self._steps, self._stop = steps, stop
        self._step = counts_as(part)(self._next)

    def poll(self) -> bool:
        """Whether it is done. Raises what its steps raise, as RequestError with the cause when it cannot be done."""
        return self._step()

    def cancel(self) -> None:
        """Stop where it is; the request counts as done."""
        self._steps = iter(())
        self._stop()

    @property
    def answer(self) -> T:
        """What came of it. Raises AttributeError before it is done."""
        return self._answer

    def _next(self) -> bool:
        try:
            next(self._steps)
        except StopIteration as end:
            if not hasattr(self, "_answer"):
                self._answer = end.value
            return True
        return False
