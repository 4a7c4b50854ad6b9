"""Grasp the connector again where it was found."""

from dataclasses import dataclass
from typing import ClassVar

from regrasp.behaviors.cable.hand import HandLeaf
from regrasp.behaviors.cable.keys import FOUND, HELD
from regrasp.behaviors.keys import Keys
from regrasp.behaviors.leaf import LeafSteps
from regrasp.motion.failure import GraspEmptyError


@dataclass(frozen=True)
class RegraspParameters:
    """How the hand leaves an empty grasp."""

    open_time: float = 0.6  # s that the jaw has to open after an empty grasp; choice


class Regrasp(HandLeaf):
    """Brings the hand to where the connector was found, closes the jaw and tells by its gap whether it holds.

    A hand that closes on nothing opens and goes back to sleep, and the leaf fails.
    """

    NEEDS: ClassVar[Keys] = (FOUND,)
    WRITES: ClassVar[Keys] = (HELD,)
    parameters: ClassVar[RegraspParameters] = RegraspParameters()

    def steps(self) -> LeafSteps:
        """See the class."""
        motion, connector = self.services.motion, self.read(FOUND).world_from_connector
        motion.set_obstacles(*self.services.perception.obstacles_beside(connector))
        yield motion.pick_loose(connector, point_cloud=self.overview_points)
        try:
            yield from self.grip(connector)
        except GraspEmptyError:
            motion.open_jaw(self.hand)
            yield from self.wait(self.parameters.open_time)
            yield from self.draw_back()
            yield from self.go_to_sleep(self.hand)
            raise
