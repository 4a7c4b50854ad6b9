"""A better look at a connector that was seen from afar or in part, before the hand goes there."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from behaviors.hand import EYE
from behaviors.leaf import Steps
from behaviors.look import LookLeaf
from interfaces.cause import CauseCode
from motion.failure import PlanningError
from motion.viewpoints import closer_views
from perception.mean_pose import mean_pose
from perception.rgbd_pose import Estimate

LOOK_SECONDS = 0.8
LOOKS = 2  # from two sides: what one look takes for an obstacle's inside, the other looks through
OTHER_SIDE = 0.77  # cosine of the 40 degrees between them


class LookCloser(LookLeaf):
    """Brings the wrist camera to two places where the whole connector should show; then the arm goes to sleep.

    Only after a find that needs it: by the wrist camera, or of a part. SUCCESS in any case: the pose found first stands
    when no better one is to be had.
    """

    def steps(self) -> Steps:
        """See the class."""
        belief = self.services.belief
        if belief.found_by == "rear" and belief.sure:
            return
        taken: list[NDArray[np.float64]] = []
        whole: list[Estimate] = []
        for _ in range(LOOKS):
            seen: list[Estimate] = []
            try:
                view, goals = self._best_view(taken)
                taken.append(view.rotation.apply([0.0, 0.0, 1.0]))
                yield from self.go_and_look(goals, LOOK_SECONDS, seen)
            except PlanningError as error:
                self.say("no closer look", why=str(error))
                continue
            whole += [e for e in seen if e.whole]
            if seen:
                belief.connector, belief.sure = mean_pose(whole or seen)
                belief.found_by = "wrist"
                self.say("looked closer", position=belief.connector.translation.round(4).tolist(), sure=belief.sure)
        yield from self.go_to_sleep(EYE)

    def _best_view(self, taken: list[NDArray[np.float64]]) -> tuple[RigidTransform, NDArray[np.float64]]:
        """The best free place that has the whole connector in sight, from another side than the lines of sight `taken`.

        With joints (n, 6) for it.
        """
        connector = self.services.belief.connector
        assert connector is not None
        half = 0.5 * self.services.known.connector.length
        points = connector.apply([[-half, 0.0, 0.0], [0.0, 0.0, 0.0], [half, 0.0, 0.0]])
        for view in closer_views(connector):
            sight = view.rotation.apply([0.0, 0.0, 1.0])
            if any(float(sight @ other) > OTHER_SIDE for other in taken):
                continue
            if self.services.motion.sees(view, points) and len(goals := self.view_goals(view)):
                return view, goals
        raise PlanningError(CauseCode.OUT_OF_REACH, "no free place from which the whole connector shows")
