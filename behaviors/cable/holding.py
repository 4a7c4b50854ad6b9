"""Whether the hand holds something."""

from typing import Any, ClassVar

from py_trees.common import Status

from regrasp.behaviors.cable.keys import HELD, NOTICES
from regrasp.behaviors.cable.services import CableServices
from regrasp.behaviors.keys import Keys
from regrasp.behaviors.leaf import Leaf
from regrasp.interfaces.cause import CauseCode


class Holding(Leaf):
    """SUCCESS when the robot believes that its hand holds the connector, else FAILURE."""

    READS: ClassVar[Keys] = (
        HELD,
        NOTICES,
    )
    INPUT_PORTS: ClassVar[dict[str, Any]] = {}
    OUTPUT_PORTS: ClassVar[dict[str, Any]] = {}
    RETURNS = frozenset({Status.SUCCESS, Status.FAILURE})
    services: CableServices

    def work(self) -> Status:
        """See the class."""
        if self.read(HELD, None) is not None:
            return Status.SUCCESS
        losses = "no loss was noticed"
        if notices := self.read(NOTICES):
            many = f"{len(notices)} losses noticed, the last" if len(notices) > 1 else "a loss was noticed"
            losses = f"{many} at {notices[-1].at:.2f} s by {notices[-1].by}"
        return self.fail(CauseCode.NOTHING_HELD, f"the hand holds nothing; {losses}")
