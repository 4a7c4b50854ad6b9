"""The safe end of a mission that failed."""

from py_trees.common import Status

from regrasp.behaviors.leaf import LeafSteps, StepsLeaf
from regrasp.interfaces.cause import CauseCode

REST = 0.3  # s within which the arms are at rest (spec)


class SafeStop(StepsLeaf):
    """Stops both arms and holds them; jaws keep their force. FAILURE once they rest: the mission failed.

    Its cause is that of what failed before; it has one of its own only where nothing names one.
    """

    RETURNS = frozenset({Status.RUNNING, Status.FAILURE})

    def steps(self) -> LeafSteps:
        """See the class."""
        self.services.motion.stop()
        yield from self.wait(REST)

    def update(self) -> Status:
        """See the class."""
        status = super().update()
        if status is not Status.SUCCESS:
            return status
        if not self.services.belief.causes:
            return self.fail(CauseCode.INTERNAL_ERROR, "stopped safely, and nothing says why")
        return self.fail_with(self.services.belief.causes[-1])
