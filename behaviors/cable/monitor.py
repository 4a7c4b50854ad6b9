"""Observe the connector while it is carried."""

from typing import Any, ClassVar

from py_trees.common import Status

from regrasp.behaviors.cable.keys import HELD
from regrasp.behaviors.cable.services import CableServices
from regrasp.behaviors.keys import Keys
from regrasp.behaviors.leaf import Leaf, LeafPort


class Monitor(Leaf):
    """Looks through the rear camera every `period` seconds and tells the track where the hand is; always SUCCESS.

    It stands before `DetectSlip` in a Sequence without memory, so that both are ticked every time.
    """

    READS: ClassVar[Keys] = (HELD,)
    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "period": LeafPort(data_type=float, required=False, default_value=0.1, above=0, description="s between looks")
    }
    OUTPUT_PORTS: ClassVar[dict[str, Any]] = {}
    RETURNS = frozenset({Status.SUCCESS})
    services: CableServices
    _due = 0.0
    _trouble = False

    def work(self) -> Status:
        """See the class."""
        perception, now, cable = self.services.perception, self.services.clock.now(), self.services.known.cable
        motion = self.services.motion
        perception.expect_in_hand(motion.tool(motion.hand), self.read(HELD, None))
        if now >= self._due - 1e-9:
            perception.look(cable.overview)
            self._due = now + self.get_input("period")
            self._tell_trouble(cable.overview)
        state, sentence = perception.state()
        self.feedback_message = f"{state.value}: {sentence}"
        return Status.SUCCESS

    def _tell_trouble(self, camera: str) -> None:
        trouble = self.services.perception.trouble(camera)
        if (trouble is not None) != self._trouble:
            self._trouble = trouble is not None
            self.say("camera", camera=camera, trusted=not self._trouble, why=trouble or "its frames are sound again")

    def terminate(self, new_status: Status) -> None:
        """When the tree stops the leaf, forget the hand: the carrying is over."""
        if new_status is Status.INVALID:
            self.services.perception.expect_in_hand(None)
            self._due = 0.0
