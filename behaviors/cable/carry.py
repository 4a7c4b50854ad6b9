"""Bring the held connector in front of the stow clip, and into it."""

from dataclasses import dataclass
from typing import ClassVar

from regrasp.behaviors.cable.hand import HandLeaf
from regrasp.behaviors.cable.keys import HELD
from regrasp.behaviors.keys import Keys
from regrasp.behaviors.leaf import LeafSteps


@dataclass(frozen=True)
class InsertParameters:
    """How long the connector is looked at in the hand, and how long its insertion takes."""

    look_time: float = 0.8  # s of looking; choice
    seat_time: float = 0.6  # s of waiting; the clip's lips take 0.2 s to close


class Carry(HandLeaf):
    """Plans the held connector's path to a place in front of the clip and follows it."""

    NEEDS: ClassVar[Keys] = (HELD,)

    def steps(self) -> LeafSteps:
        """See the class."""
        yield self.services.motion.carry_to_clip(self.held())


class Insert(HandLeaf):
    """Looks how the connector lies in the hand, and brings it straight into the clip."""

    NEEDS: ClassVar[Keys] = (HELD,)
    WRITES: ClassVar[Keys] = (HELD,)
    parameters: ClassVar[InsertParameters] = InsertParameters()

    def steps(self) -> LeafSteps:
        """See the class."""
        yield from self._look()
        yield self.services.motion.insert(self.held())
        yield from self.wait(self.parameters.seat_time)

    def _look(self) -> LeafSteps:
        """Correct the belief of how the connector lies in the hand by what the overview camera sees of it."""
        motion, perception = self.services.motion, self.services.perception
        # Only later frames: in this moment the hand may still move.
        looked = yield from self.ask(perception.watch(self.overview, self.parameters.look_time, later=True))
        seen = looked.estimates
        held = self.read(HELD, None)
        found = None if held is None else perception.in_hand(seen, motion.tool(self.hand), held)
        if found is None:
            self.say("the hand hides the connector", frames=len(seen))
            return
        shift, turn = round(found.shift, 4), round(found.turn_deg, 1)
        self.say("connector in the hand", whole=found.whole, shift=shift, turn_deg=turn, trusted=found.trusted)
        if found.trusted:
            self.write(HELD, found.pose)
