"""The safe end of a mission that failed."""

from py_trees.common import Status

from behaviors.leaf import Steps, StepsLeaf
from interfaces.cause import CauseCode

REST = 0.3  # s within which the arms are at rest (spec)


class SafeStop(StepsLeaf):
    """Stops both arms and holds them; jaws keep their force. FAILURE once they rest: the mission failed.

    What failed before has named the cause; the stop itself names one only where nothing did.
    """

    RETURNS = frozenset({Status.RUNNING, Status.FAILURE})

    def steps(self) -> Steps:
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
        self.feedback_message = f"stopped safely: {self.services.belief.causes[-1].message}"
        return Status.FAILURE
