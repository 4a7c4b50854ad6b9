"""A better look at a connector that was seen from afar or in part, before the hand goes there."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from regrasp.behaviors.cable.hand import CAMERA_ARM
from regrasp.behaviors.cable.look import LookLeaf
from regrasp.behaviors.leaf import LeafSteps
from regrasp.motion.failure import PlanningError
from regrasp.perception.pose.estimate import Estimate
from regrasp.perception.pose.fusion import fuse


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
        belief = self.services.belief
        if belief.found_by == "rear" and belief.sure:
            return
        taken: list[NDArray[np.float64]] = []
        whole: list[Estimate] = []
        for _ in range(self.parameters.looks):
            seen: list[Estimate] = []
            try:
                assert belief.connector is not None
                view, goals = self.best_view(belief.connector, taken)
                taken.append(view.rotation.apply([0.0, 0.0, 1.0]))
                yield from self.go_and_look(goals, self.parameters.look_time, seen)
            except PlanningError as error:
                self.say("no closer look", why=str(error))
                continue
            whole += [e for e in seen if e.whole]
            if seen:
                found = fuse(whole or seen)
                belief.connector, belief.sure = found.world_from_connector, found.whole
                belief.found_by = "wrist"
                self.say("looked closer", position=belief.connector.translation.round(4).tolist(), sure=belief.sure)
        yield from self.go_to_sleep(CAMERA_ARM)
