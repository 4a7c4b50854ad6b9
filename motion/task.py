"""Work of an arm under way."""

from collections.abc import Callable, Iterator


class Task:
    """Work of an arm under way, one step a `poll`."""

    def __init__(self, steps: Iterator[None], stop: Callable[[], None]) -> None:
        self._steps, self._stop = steps, stop

    def poll(self) -> bool:
        """Whether it is done. Raises PlanningError with the cause when it cannot be."""
        try:
            next(self._steps)
        except StopIteration:
            return True
        return False

    def cancel(self) -> None:
        """Stop the arm where it is."""
        self._steps = iter(())
        self._stop()
