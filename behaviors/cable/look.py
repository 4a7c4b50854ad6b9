"""Looking with the wrist camera from a place, which the search and the closer look share."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.behaviors.cable.hand import EYE, HandLeaf
from regrasp.behaviors.leaf import Steps
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.cell import WristMount
from regrasp.motion.failure import PlanningError
from regrasp.motion.planning.viewpoints import closer_views
from regrasp.perception.pose.estimate import Estimate

LOOK_MARGIN = 0.02  # m: the searching arm moves among things that it has seen from one side only
OTHER_SIDE = 0.77  # cosine of the 40 degrees between two lines of sight from different sides
SOUND = 3  # frames from a place before one is mapped: by then a frozen camera shows
SETTLE_SECONDS = 0.1  # frames exposed while the arm still swings do not count


class LookLeaf(HandLeaf):
    """A state in which the left arm's camera looks round."""

    def view_goals(self, world_from_camera: RigidTransform) -> NDArray[np.float64]:
        """Joints (n, 6) of the left arm, free, that bring its camera there."""
        motion = self.services.motion
        mount = self.services.known.camera("wrist").mount
        assert isinstance(mount, WristMount)
        model = motion.model(EYE)
        views = motion.kinematics[EYE].ik_view(world_from_camera, mount.wrist_from_camera)
        return np.array([q for q in views if model.free(q, LOOK_MARGIN)]).reshape(-1, 6)

    def best_view(
        self, connector: RigidTransform, taken: Sequence[NDArray[np.float64]] = ()
    ) -> tuple[RigidTransform, NDArray[np.float64]]:
        """The best free place that has the whole connector in sight, from another side than the lines of sight `taken`.

        With joints (n, 6) for it. Raises PlanningError when there is none.
        """
        half = 0.5 * self.services.known.connector.length
        points = connector.apply([[-half, 0.0, 0.0], [0.0, 0.0, 0.0], [half, 0.0, 0.0]])
        for view in closer_views(connector):
            sight = view.rotation.apply([0.0, 0.0, 1.0])
            if any(float(sight @ other) > OTHER_SIDE for other in taken):
                continue
            if self.services.motion.sees(view, points) and len(goals := self.view_goals(view)):
                return view, goals
        raise PlanningError(CauseCode.OUT_OF_REACH, "no free place from which the whole connector shows")

    def go_and_look(
        self,
        goals: NDArray[np.float64],
        seconds: float,
        seen: list[Estimate],
        glimpses: list[NDArray[np.float64]] | None = None,
    ) -> Steps:
        """Move the camera to one of the goals, look for so long, gather estimates in `seen`, map what stands there.

        `glimpses`: places (3,) m where something showed that may be the connector.

        Unlike a yielded task, a motion that cannot be raises its PlanningError here, to the caller.
        """
        clock, perception, motion = self.services.clock, self.services.perception, self.services.motion
        yield from self.follow(motion.move(EYE, goals, margin=LOOK_MARGIN, tight=False))
        begin = clock.now() + SETTLE_SECONDS
        stamps: set[float] = set()
        while clock.now() < begin + seconds - 1e-9:
            yield None
            result = perception.look("wrist")
            if result is None or result.stamp < begin or result.stamp in stamps:
                continue
            stamps.add(result.stamp)
            if len(stamps) == SOUND and perception.trouble("wrist") is None:
                perception.map_obstacles("wrist")
                motion.set_obstacles(perception.occupancy.occupied_points(), perception.occupancy.voxel_size)
            if isinstance(result, Estimate):
                seen.append(result)
            elif glimpses is not None and result.weak_detection is not None:
                glimpses.append(result.weak_detection)
