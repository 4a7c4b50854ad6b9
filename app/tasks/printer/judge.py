"""The judge of the printer task."""

from collections.abc import Iterator
from typing import Any

from regrasp.app.task import judge
from regrasp.app.task.expectation import Expectation
from regrasp.app.tasks.printer.expectations import Expect


class PrinterJudge(judge.Judge[Expect]):
    """Judges the door's true opening."""

    def states(self) -> Iterator[Expectation]:
        """See `Judge`."""
        if self.expect.door_open is not None:
            opening = self.world.objects.door.opening
            yield Expectation("door_open", opening >= self.expect.door_open, round(opening, 4), self.expect.door_open)

    def measured(self) -> dict[str, Any]:
        """See `Judge`."""
        return {"door_open": round(self.world.objects.door.opening, 4)}
