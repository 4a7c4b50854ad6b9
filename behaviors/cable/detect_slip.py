"""Notice that the connector has left the hand."""

from typing import Any, ClassVar

from py_trees.common import Status

from regrasp.behaviors.cable.keys import HELD, NOTICES, LossNotice
from regrasp.behaviors.cable.services import CableServices
from regrasp.behaviors.keys import Keys
from regrasp.behaviors.leaf import Leaf
from regrasp.interfaces.cable.cause import CableCause


class DetectSlip(Leaf):
    """RUNNING while the connector is held; FAILURE, with the test that found it, once it has slipped.

    The thesis's test is the distance between gripper and estimated connector. It misses an end that stays near the
    jaw; there the finger gap tells at once.
    """

    READS: ClassVar[Keys] = (NOTICES,)
    WRITES: ClassVar[Keys] = (NOTICES,)
    CLEARS: ClassVar[Keys] = (HELD,)
    INPUT_PORTS: ClassVar[dict[str, Any]] = {}
    OUTPUT_PORTS: ClassVar[dict[str, Any]] = {}
    RETURNS = frozenset({Status.RUNNING, Status.FAILURE})
    services: CableServices

    def initialise(self) -> None:
        """Forget the readings of an earlier carry."""
        self._grip = self.services.motion.watch_grip()

    def work(self) -> Status:
        """See the class."""
        motion = self.services.motion
        tool = motion.tool(motion.hand)
        for evidence in (self._grip.evidence(), self.services.perception.slipped(tool)):
            if evidence is not None and evidence.detected:
                self.clear(HELD)
                self.write(NOTICES, (*self.read(NOTICES), LossNotice(self.services.clock.now(), evidence.by)))
                self.say("slip", by=evidence.by, value=round(evidence.value, 4), limit=evidence.limit)
                return self.fail(CableCause.SLIPPED, evidence.sentence)
        return Status.RUNNING
