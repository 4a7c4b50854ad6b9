"""Grasp the connector again where it was found."""

from typing import ClassVar

from regrasp.behaviors.cable.hand import HandLeaf
from regrasp.behaviors.cable.keys import FOUND, HELD
from regrasp.behaviors.keys import Keys
from regrasp.behaviors.leaf import LeafSteps
from regrasp.interfaces.cause import CauseCode
from regrasp.motion.failure import PlanningError

# After these causes another arm may find a way.
NO_GRASP_OR_WAY = (
    CauseCode.NO_COLLISION_FREE_GOAL,
    CauseCode.OUT_OF_REACH,
    CauseCode.PLANNING_FAILED,
    CauseCode.MOTION_BLOCKED,
)


class Regrasp(HandLeaf):
    """Brings an arm to where the connector was found, closes the jaw and tells by its gap whether it holds.

    The arm that can do it best is the hand from now on. One that finds no way there goes to sleep, and the next one
    tries. A hand that closes on nothing opens and goes back to sleep, and the leaf fails.
    """

    NEEDS: ClassVar[Keys] = (FOUND,)
    WRITES: ClassVar[Keys] = (HELD,)

    def steps(self) -> LeafSteps:
        """See the class."""
        motion, connector = self.services.motion, self.read(FOUND).world_from_connector
        motion.set_obstacles(*self.services.perception.obstacles_beside(connector))
        hands = yield from self.ask(motion.hands_for(connector))
        for arm in hands:
            motion.take_with(arm)
            self.say("takes it", arm=arm)
            try:
                yield from self.ask(motion.pick_loose(connector, point_cloud=self.overview_points))
                break
            except PlanningError as error:
                if error.code not in NO_GRASP_OR_WAY:
                    raise
                yield from self.go_to_sleep(arm)
                if arm == hands[-1]:
                    raise
                self.say("leaves it to the other arm", arm=arm, why=str(error))
        yield from self.grip_or_leave(connector)
