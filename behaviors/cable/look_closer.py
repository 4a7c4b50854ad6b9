"""A better look at a connector that was seen from afar or in part, before the hand goes there."""

from dataclasses import dataclass
from typing import ClassVar

from regrasp.behaviors.cable.look import LookLeaf
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

    It does so only when the wrist camera found the connector, or only a part of it was seen. SUCCESS in any case: where
    no better pose is found, the first one stands.
    """

    parameters: ClassVar[LookCloserParameters] = LookCloserParameters()

    def steps(self) -> LeafSteps:
        """See the class."""
        belief, motion = self.services.belief, self.services.motion
        if belief.found_by == self.overview and belief.sure:
            return
        taken: list[FloatArray] = []
        whole: list[Estimate] = []
        for _ in range(self.parameters.looks):
            try:
                assert belief.connector is not None
                view = motion.best_view(belief.connector, taken)
                taken.append(view.sight)
                looked = yield from self.go_and_look(view, self.parameters.look_time)
            except PlanningError as error:
                self.say("no closer look", why=str(error))
                continue
            whole += [e for e in looked.estimates if e.whole]
            if looked.estimates:
                found = self.services.perception.fuse(whole or looked.estimates)
                belief.connector, belief.sure = found.world_from_connector, found.whole
                belief.found_by = self.search
                self.say("looked closer", position=belief.connector.translation.round(4).tolist(), sure=belief.sure)
        yield from self.go_to_sleep(self.search_arm)
