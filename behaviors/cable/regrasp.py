"""Grasp the connector again where it was found."""

from typing import ClassVar

from regrasp.behaviors.cable.hand import HandLeaf
from regrasp.behaviors.cable.keys import FOUND, HELD, VAIN_CARRIES
from regrasp.behaviors.keys import Keys
from regrasp.behaviors.leaf import LeafSteps


class Regrasp(HandLeaf):
    """Brings an arm to where the connector was found, closes the jaw and tells by its gap whether it holds.

    The arm that can do it best is the hand from now on. One that finds no way there goes to sleep, and the next one
    tries. A hand that closes on nothing opens and goes back to sleep, and the leaf fails.
    """

    NEEDS: ClassVar[Keys] = (FOUND,)
    WRITES: ClassVar[Keys] = (HELD, VAIN_CARRIES)

    def steps(self) -> LeafSteps:
        """See the class."""
        motion, connector = self.services.motion, self.read(FOUND).world_from_connector
        motion.set_obstacles(*self.services.perception.obstacles_beside(connector))
        hands = yield from self.ask(motion.hands_for(connector))
        yield from self.take(hands, lambda: motion.pick_loose(connector, point_cloud=self.overview_points))
        self.say("took it", arm=motion.hand)
        yield from self.grip_or_leave(connector)
