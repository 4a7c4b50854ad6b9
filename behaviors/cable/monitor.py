"""Observe the connector while it is carried."""

from typing import Any, ClassVar

from py_trees.common import Status

from regrasp.behaviors.cable.hand import HANDLING_ARM
from regrasp.behaviors.leaf import Leaf, LeafPort


class Monitor(Leaf):
    """Looks through the rear camera every `period` seconds and tells the track where the hand is; always SUCCESS.

    It stands before `DetectSlip` in a Sequence without memory, so that both are ticked every time.
    """

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "period": LeafPort(data_type=float, required=False, default_value=0.1, above=0, description="s between looks")
    }
    OUTPUT_PORTS: ClassVar[dict[str, Any]] = {}
    RETURNS = frozenset({Status.SUCCESS})
    _due = 0.0
    _trouble = False

    def work(self) -> Status:
        """See the class."""
        perception, now = self.services.perception, self.services.clock.now()
        tool, held = self.services.motion.tool(HANDLING_ARM), self.services.belief.held
        axis = None if held is None else (tool * held).rotation.apply([1.0, 0.0, 0.0])
        perception.expect_in_hand(tool.translation, axis)
        if now >= self._due - 1e-9:
            perception.look("rear")
            self._due = now + self.get_input("period")
            self._tell_trouble(perception.trouble("rear"))
        state, sentence = perception.track.state(now)
        self.feedback_message = f"{state.value}: {sentence}"
        return Status.SUCCESS

    def _tell_trouble(self, trouble: str | None) -> None:
        if (trouble is not None) != self._trouble:
            self._trouble = trouble is not None
            self.say("camera", camera="rear", trusted=not self._trouble, why=trouble or "its frames are sound again")

    def terminate(self, new_status: Status) -> None:
        """When the tree stops the leaf, forget the hand: the carrying is over."""
        if new_status is Status.INVALID:
            self.services.perception.expect_in_hand(None, None)
            self._due = 0.0
