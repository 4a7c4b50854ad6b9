"""A better look at a connector that was seen from afar or in part, before the hand goes there."""

import numpy as np
from numpy.typing import NDArray

from behaviors.hand import EYE
from behaviors.leaf import Steps
from behaviors.look import LookLeaf
from interfaces.cause import CauseCode
from motion.failure import PlanningError
from motion.viewpoints import closer_views
from perception.mean_pose import mean_pose
from perception.rgbd_pose import Estimate

LOOK_SECONDS = 0.8
LOOKS = 3  # at most


class LookCloser(LookLeaf):
    """Brings the wrist camera to where the whole connector should show, until it does; then the arm goes to sleep.

    Only after a find that needs it: by the wrist camera, or of a part. SUCCESS in any case: the pose found first stands
    when no better one is to be had.
    """

    def steps(self) -> Steps:
        """See the class."""
        belief = self.services.belief
        if belief.found_by == "rear" and belief.sure:
            return
        for _ in range(LOOKS):
            seen: list[Estimate] = []
            try:
                yield from self.go_and_look(self._goals(), LOOK_SECONDS, seen)
            except PlanningError as error:
                self.say("no closer look", why=str(error))
                break
            if seen:
                belief.connector, belief.sure = mean_pose(seen)
                belief.found_by = "wrist"
                self.say("looked closer", position=belief.connector.translation.round(4).tolist(), sure=belief.sure)
                if belief.sure:
                    break
        yield from self.go_to_sleep(EYE)

    def _goals(self) -> NDArray[np.float64]:
        """Joints (n, 6) for the best place that is free and has the whole connector in sight."""
        connector = self.services.belief.connector
        assert connector is not None
        half = 0.5 * self.services.known.connector.length
        points = connector.apply([[-half, 0.0, 0.0], [0.0, 0.0, 0.0], [half, 0.0, 0.0]])
        for view in closer_views(connector):
            if self.services.motion.sees(view, points) and len(goals := self.view_goals(view)):
                return goals
        raise PlanningError(CauseCode.OUT_OF_REACH, "no free place from which the whole connector shows")
