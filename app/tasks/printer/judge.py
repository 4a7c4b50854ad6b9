"""The judge of the printer task."""

from collections.abc import Iterator
from typing import Any

from regrasp.app.task import judge
from regrasp.app.task.expectation import Expectation
from regrasp.app.tasks.printer.expectations import Expect


class PrinterJudge(judge.Judge[Expect]):
    """Judges the door's true opening, and whether the part is held."""

    def states(self) -> Iterator[Expectation]:
        """See `Judge`."""
        if self.expect.door_open is not None:
            opening = self.world.objects.door.opening
            yield Expectation("door_open", opening >= self.expect.door_open, round(opening, 4), self.expect.door_open)
        if self.expect.part_held is not None:
            held = self._held()
            yield Expectation("part_held", held == self.expect.part_held, held, self.expect.part_held)
        for name, there in self._places().items():
            if (wanted := getattr(self.expect, name)) is not None:
                yield Expectation(name, there == wanted, there, wanted)

    def _places(self) -> dict[str, bool]:
        """Whether door, part and plate are where the whole job brings them."""
        objects = self.world.objects
        return {
            "door_closed": objects.door_closed(),
            "part_in_tray": objects.part_in_tray(),
            "plate_in_clamp": objects.plate_in_clamp(),
        }

    def _held(self) -> bool:
        objects = self.world.objects
        return bool(objects.part.held_by(self.world.arms[objects.cell.known.printer.hand]))

    def measured(self) -> dict[str, Any]:
        """See `Judge`."""
        return {
            "door_open": round(self.world.objects.door.opening, 4),
            "part_held": self._held(),
            **self._places(),
        }
