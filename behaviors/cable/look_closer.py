"""A better look at a connector that was seen from afar or in part, before the hand goes there."""

from dataclasses import dataclass
from typing import ClassVar

from regrasp.behaviors.cable.keys import FOUND, Found
from regrasp.behaviors.cable.look import LookLeaf
from regrasp.behaviors.keys import Keys
from regrasp.behaviors.leaf import LeafSteps
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.sight import Estimate
from regrasp.motion.failure import PlanningError


@dataclass(frozen=True)
class LookCloserParameters:
    """How long and how often the camera looks."""

    look_time: float = 0.8  # s of looking from a viewpoint; choice
    looks: int = 2  # from two sides: one look takes space behind a surface for occupied, the other sees into it


class LookCloser(LookLeaf):
    """Brings the wrist camera to two viewpoints where the whole connector should show; then the arm goes to sleep.

    It does so only when the wrist camera found the connector, when only a part of it was seen, or when every grasp of
    it leads through space that no camera has seen. SUCCESS in any case: where no better pose is found, the first one
    stands.
    """

    NEEDS: ClassVar[Keys] = (FOUND,)
    WRITES: ClassVar[Keys] = (FOUND,)
    parameters: ClassVar[LookCloserParameters] = LookCloserParameters()

    def steps(self) -> LeafSteps:
        """See the class."""
        best, motion = self.read(FOUND), self.services.motion
        connector = best.world_from_connector
        motion.set_obstacles(*self.services.perception.obstacles_beside(connector))
        if best.camera == self.overview and best.whole and motion.can_pick_loose(connector):
            return
        taken: list[FloatArray] = []
        whole: list[Estimate] = []
        for _ in range(self.parameters.looks):
            try:
                view = motion.best_view(best.world_from_connector, taken)
                taken.append(view.sight)
                looked = yield from self.go_and_look(view, self.parameters.look_time)
            except PlanningError as error:
                self.say("no closer look", why=str(error))
                continue
            whole += [e for e in looked.estimates if e.whole]
            if looked.estimates:
                found = self.services.perception.fuse(whole or looked.estimates)
                best = Found(found.world_from_connector, found.whole, self.search)
                self.write(FOUND, best)
                position = best.world_from_connector.translation.round(4).tolist()
                self.say("looked closer", position=position, sure=best.whole)
        yield from self.go_to_sleep(self.search_arm)
