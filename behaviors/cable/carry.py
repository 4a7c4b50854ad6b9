"""Bring the held connector in front of the stow clip, and into it."""

from dataclasses import dataclass
from typing import ClassVar

from regrasp.behaviors.cable.hand import HandLeaf, LookInHand
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


class Insert(LookInHand):
    """Looks how the connector lies in the hand, and brings it straight into the clip."""

    NEEDS: ClassVar[Keys] = (HELD,)
    parameters: ClassVar[InsertParameters] = InsertParameters()

    def steps(self) -> LeafSteps:
        """See the class."""
        yield from self.look_in_hand(self.parameters.look_time)
        yield self.services.motion.insert(self.held())
        yield from self.wait(self.parameters.seat_time)
