"""Notice that the connector has left the hand."""

from typing import Any, ClassVar

from py_trees.common import Status

from regrasp.behaviors.cable.hand import HANDLING_ARM
from regrasp.behaviors.leaf import Leaf
from regrasp.behaviors.services import LossNotice
from regrasp.interfaces.cable.cause import CableCause
from regrasp.perception.tracking.slip import GapTest, SlipEvidence, distance_slip
from regrasp.perception.tracking.track import TrackState


class DetectSlip(Leaf):
    """RUNNING while the connector is held; FAILURE, with the test that found it, once it has slipped.

    The thesis's test is the distance between gripper and estimated connector. It misses an end that stays near the
    jaw; there the finger gap tells at once.
    """

    INPUT_PORTS: ClassVar[dict[str, Any]] = {}
    OUTPUT_PORTS: ClassVar[dict[str, Any]] = {}
    RETURNS = frozenset({Status.RUNNING, Status.FAILURE})

    def initialise(self) -> None:
        """Forget the readings of an earlier carry."""
        self._gap = GapTest(2 * self.services.known.cable.connector.radius)

    def work(self) -> Status:
        """See the class."""
        self._gap.feed(self.services.motion.grippers[HANDLING_ARM].reading())
        for evidence in (self._gap.evidence(), self._distance()):
            if evidence is not None and evidence.detected:
                self.services.belief.held = None
                self.services.belief.notices.append(LossNotice(self.services.clock.now(), evidence.by))
                self.say("slip", by=evidence.by, value=round(evidence.value, 4), limit=evidence.limit)
                return self.fail(CableCause.SLIPPED, evidence.sentence)
        return Status.RUNNING

    def _distance(self) -> SlipEvidence | None:
        """The thesis's test, only while the connector is seen: one that the hand hides has not slipped."""
        track, now = self.services.perception.track, self.services.clock.now()
        if track.last is None or track.state(now)[0] is not TrackState.VISIBLE:
            return None
        return distance_slip(self.services.motion.tool(HANDLING_ARM).translation, track.last.position)
