"""Looking with the wrist camera from a viewpoint, which the search and the closer look share."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from regrasp.behaviors.cable.hand import CAMERA_ARM, HandLeaf
from regrasp.behaviors.leaf import LeafSteps
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.wall_time import counts_as
from regrasp.motion.failure import PlanningError
from regrasp.motion.planning.viewpoints import CloseViewParameters, closer_views
from regrasp.perception.pose.estimate import Estimate

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform

    from regrasp.motion.scene.collision import CollisionModel


@dataclass(frozen=True)
class LookParameters:
    """How the camera arm moves and looks."""

    margin: float = 0.02  # m of clearance: the arm moves among things that were seen from one side only
    max_cosine: float = 0.77  # of the angle between lines of sight from different sides: at least 40 degrees
    frames_before_mapping: int = 3  # a frozen camera is noticed after so many frames
    settle_time: float = 0.1  # s after a motion; frames exposed while the arm still swings do not count
    close_views: CloseViewParameters = field(default_factory=CloseViewParameters)


class LookLeaf(HandLeaf):
    """A leaf in which the camera arm looks round."""

    view: ClassVar[LookParameters] = LookParameters()

    def view_goals(self, world_from_camera: "RigidTransform", model: "CollisionModel") -> NDArray[np.float64]:
        """Joint vectors (n, 6) rad of the camera arm that bring its camera there and are free in its `model`."""
        from regrasp.interfaces.cell import WristMount

        motion = self.services.motion
        mount = self.services.known.camera("wrist").mount
        assert isinstance(mount, WristMount)
        views = motion.kinematics[CAMERA_ARM].ik_view(world_from_camera, mount.wrist_from_camera)
        return np.array([q for q in views if model.free(q, self.view.margin)]).reshape(-1, 6)

    @counts_as("planning")
    def best_view(
        self, connector: "RigidTransform", taken: Sequence[NDArray[np.float64]] = ()
    ) -> "tuple[RigidTransform, NDArray[np.float64]]":
        """The best viewpoint (world_from_camera) that shows the whole connector, with free joints (n, 6) rad for it.

        It looks from another side than the lines of sight `taken`, unit vectors (3,) in the world. `connector` is
        world_from_connector. Raises PlanningError when there is none.
        """
        model = self.services.motion.model(CAMERA_ARM)
        half = 0.5 * self.services.known.cable.connector.length
        points = connector.apply([[-half, 0.0, 0.0], [0.0, 0.0, 0.0], [half, 0.0, 0.0]])
        for view in closer_views(connector, self.view.close_views):
            sight = view.rotation.apply([0.0, 0.0, 1.0])
            if any(float(sight @ other) > self.view.max_cosine for other in taken):
                continue
            if self.services.motion.sees(view, points) and len(goals := self.view_goals(view, model)):
                return view, goals
        raise PlanningError(CauseCode.OUT_OF_REACH, "no free place from which the whole connector shows")

    def go_and_look(
        self,
        goals: NDArray[np.float64],
        seconds: float,
        seen: list[Estimate],
        weak_detections: list[NDArray[np.float64]] | None = None,
    ) -> LeafSteps:
        """Move the camera to one of the goals (n, 6) rad, look for `seconds`, and map the obstacles that it sees.

        Estimates are appended to `seen`. To `weak_detections` are appended places (3,) m in the world where something
        showed that may be the connector. Raises PlanningError to the caller when no motion leads there.
        """
        clock, perception, motion = self.services.clock, self.services.perception, self.services.motion
        yield from self.follow(motion.move(CAMERA_ARM, goals, margin=self.view.margin, tight=False))
        begin = clock.now() + self.view.settle_time
        stamps: set[float] = set()
        while clock.now() < begin + seconds - 1e-9:
            yield None
            result = perception.look("wrist")
            if result is None or result.stamp < begin or result.stamp in stamps:
                continue
            stamps.add(result.stamp)
            if len(stamps) == self.view.frames_before_mapping and perception.trouble("wrist") is None:
                perception.map_obstacles("wrist")
                motion.set_obstacles(perception.occupancy.occupied_points(), perception.occupancy.voxel_size)
            if isinstance(result, Estimate):
                seen.append(result)
            elif weak_detections is not None and result.weak_detection is not None:
                weak_detections.append(result.weak_detection)
