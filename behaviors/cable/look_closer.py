"""A better look at a connector that was seen from afar or in part, before the hand goes there."""

import numpy as np
from numpy.typing import NDArray

from regrasp.behaviors.cable.hand import CAMERA_ARM
from regrasp.behaviors.cable.look import LookLeaf
from regrasp.behaviors.leaf import LeafSteps
from regrasp.motion.failure import PlanningError
from regrasp.perception.pose.estimate import Estimate
from regrasp.perception.pose.fusion import fuse

LOOK_SECONDS = 0.8
LOOKS = 2  # from two sides: what one look takes for an obstacle's inside, the other looks through


class LookCloser(LookLeaf):
    """Brings the wrist camera to two places where the whole connector should show; then the arm goes to sleep.

    Only after a find that needs it: by the wrist camera, or of a part. SUCCESS in any case: the pose found first stands
    when no better one is to be had.
    """

    def steps(self) -> LeafSteps:
        """See the class."""
        belief = self.services.belief
        if belief.found_by == "rear" and belief.sure:
            return
        taken: list[NDArray[np.float64]] = []
        whole: list[Estimate] = []
        for _ in range(LOOKS):
            seen: list[Estimate] = []
            try:
                assert belief.connector is not None
                view, goals = self.best_view(belief.connector, taken)
                taken.append(view.rotation.apply([0.0, 0.0, 1.0]))
                yield from self.go_and_look(goals, LOOK_SECONDS, seen)
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
