"""Is there something in the hand?"""

from typing import Any, ClassVar

from py_trees.common import Status

from behaviors.leaf import Leaf
from interfaces.cause import CauseCode


class Holding(Leaf):
    """SUCCESS when the robot believes that its right hand holds the connector, else FAILURE."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {}
    OUTPUT_PORTS: ClassVar[dict[str, Any]] = {}
    RETURNS = frozenset({Status.SUCCESS, Status.FAILURE})

    def work(self) -> Status:
        """See the class."""
        belief = self.services.belief
        if belief.held is not None:
            return Status.SUCCESS
        last = f", the last at {belief.notices[-1].at:.2f} s by {belief.notices[-1].by}" if belief.notices else ""
        return self.fail(CauseCode.NOTHING_HELD, f"the hand holds nothing; {len(belief.notices)} losses noticed{last}")
