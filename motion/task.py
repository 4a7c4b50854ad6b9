"""A motion under way, as the leaves poll it."""

from collections.abc import Callable, Iterator

from regrasp.interfaces.wall_time import counts_as


class MotionTask:
    """A motion of an arm or its jaw under way; every `poll` does one step of it.

    `stop` is called by `cancel` and stops the arm.
    """

    def __init__(self, steps: Iterator[None], stop: Callable[[], None]) -> None:
        self._steps, self._stop = steps, stop

    @counts_as("planning")
    def poll(self) -> bool:
        """Whether it is done. Raises PlanningError with the cause when it cannot be done."""
        try:
            next(self._steps)
        except StopIteration:
            return True
        return False

    def cancel(self) -> None:
        """Stop the arm where it is; the task counts as done."""
        self._steps = iter(())
        self._stop()
