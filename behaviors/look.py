"""Looking with the wrist camera from a place, which the search and the closer look share."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from behaviors.hand import EYE, HandLeaf
from behaviors.leaf import Steps
from interfaces.cell import WristMount
from perception.rgbd_pose import Estimate

LOOK_MARGIN = 0.02  # m: the searching arm moves among things that it has seen from one side only
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

    def go_and_look(self, goals: NDArray[np.float64], seconds: float, seen: list[Estimate]) -> Steps:
        """Move the camera to one of the goals, look for so long, gather estimates in `seen`, map what stands there.

        Unlike a yielded task, a motion that cannot be raises its PlanningError here, to the caller.
        """
        clock, perception, motion = self.services.clock, self.services.perception, self.services.motion
        yield from self.follow(motion.move(EYE, goals, margin=LOOK_MARGIN, tight=False))
        begin, mapped = clock.now() + SETTLE_SECONDS, False
        stamps: set[float] = set()
        while clock.now() < begin + seconds - 1e-9:
            yield None
            result = perception.look("wrist")
            if result is None or result.stamp < begin or result.stamp in stamps:
                continue
            stamps.add(result.stamp)
            if not mapped:
                perception.map_obstacles("wrist")
                motion.set_obstacles(perception.occupancy.occupied_points(), perception.occupancy.h)
                mapped = True
            if isinstance(result, Estimate):
                seen.append(result)
