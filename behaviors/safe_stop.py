"""The safe end of a mission that failed."""

from py_trees.common import Status

from behaviors.leaf import Failed, Steps, StepsLeaf
from interfaces.cause import CauseCode

REST = 0.3  # s within which the arms are at rest (spec)


class SafeStop(StepsLeaf):
    """Stops both arms and holds them; jaws keep their force. FAILURE once they rest: the mission failed."""

    RETURNS = frozenset({Status.RUNNING, Status.FAILURE})

    def steps(self) -> Steps:
        """See the class."""
        self.services.motion.stop()
        yield from self.wait(REST)
        causes = self.services.belief.causes
        last = f": {causes[-1].message}" if causes else ""
        raise Failed(causes[-1].code if causes else CauseCode.INTERNAL_ERROR, f"stopped safely{last}")
