"""The safe end of a mission that failed."""

from dataclasses import dataclass
from typing import ClassVar

from py_trees.common import Status

from regrasp.behaviors.keys import CAUSES
from regrasp.behaviors.leaf import LeafSteps, StepsLeaf
from regrasp.interfaces.cause import CauseCode


@dataclass(frozen=True)
class SafeStopParameters:
    """How long the leaf waits for the arms."""

    stop_time: float = 0.3  # s within which the arms are at rest (spec)


class SafeStop(StepsLeaf):
    """Stops the arms and holds them; the jaws keep their force. FAILURE once the arms rest: the mission has failed.

    Its cause is that of the leaf that failed last. It has a cause of its own only when no leaf has named one.
    """

    parameters: ClassVar[SafeStopParameters] = SafeStopParameters()

    RETURNS = frozenset({Status.RUNNING, Status.FAILURE})

    def steps(self) -> LeafSteps:
        """See the class."""
        self.services.motion.stop()
        yield from self.wait(self.parameters.stop_time)

    def update(self) -> Status:
        """Turn the end of the steps into FAILURE."""
        status = super().update()
        if status is not Status.SUCCESS:
            return status
        causes = self.read(CAUSES)
        if not causes:
            return self.fail(CauseCode.INTERNAL_ERROR, "stopped safely, and nothing says why")
        return self.fail_with(causes[-1])
