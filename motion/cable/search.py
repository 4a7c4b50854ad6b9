"""What the leaves ask of the arm that carries the camera that looks for a lost end."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arguments import finite_pose, vector
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cable.motion import View, Viewpoint
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.cell import FixedMount
from regrasp.interfaces.scene import EARTH_GRAVITY
from regrasp.interfaces.wall_time import counts_as
from regrasp.motion.cable.cable_path import natural_poses
from regrasp.motion.cable.viewing import ViewingParameters, approached, outline, views_of
from regrasp.motion.cable.viewpoints import closer_views, spiral
from regrasp.motion.failure import PlanningError
from regrasp.motion.request import MotionRequest
from regrasp.motion.robots.views import ik_view
from regrasp.motion.scene.collision import CollisionModel
from regrasp.motion.service import Motion, MotionParameters


@dataclass(frozen=True)
class SearchMotionParameters(MotionParameters):
    """Those of every task, and of the looks for the connector."""

    viewing: ViewingParameters = field(default_factory=ViewingParameters)


class SearchMotion(Motion):
    """Brings the camera that searches where it shall look from."""

    known: CableKnown
    parameters: SearchMotionParameters

    @property
    def search_arm(self) -> str:
        """The arm that carries the camera."""
        return self.known.search_mount.arm

    def search_views(self, last_seen: FloatArray | None) -> tuple[FloatArray, Iterator[Viewpoint]]:
        """Where a search begins, (3,) m in the world, and its viewpoints, the first first.

        It begins where the connector was `last_seen` (3,) m; None: at the middle of a panel.
        """
        start, viewing = None if last_seen is None else vector("the place", last_seen), self.parameters.viewing
        if start is None:
            start = np.array(next(box.center for box in self.known.boxes if box.name == viewing.start_at))
        overview = self.known.camera(self.known.cable.overview)
        assert isinstance(overview.mount, FixedMount)  # the cell's check
        return start, spiral(start, overview.mount.world_from_camera, overview.intrinsics, viewing.spiral)

    @counts_as("planning")
    def rest_views(self) -> list[RigidTransform]:
        """Viewpoints (world_from_camera) that show the connector where its cable hangs by itself, the best first.

        There a lost end comes to rest unless something holds it. The cable's stiffness is not known: with gravity it
        is taken to sag by the parameters' `sag`.
        """
        viewing = self.parameters.viewing
        gravity = self.arms[self.search_arm].gravity()
        _, course = self.known.cable.anchor
        sag = viewing.sag * gravity / EARTH_GRAVITY
        place = RigidTransform.from_matrix(natural_poses(self.known, (sag - (sag @ course) * course)[None])[0])
        views: list[View] = []
        with suppress(PlanningError):
            while len(views) < viewing.rest_looks:
                views.append(self.best_view(place, [view.sight for view in views]))
        return [view.world_from_camera for view in views]

    def view(self, world_from_camera: RigidTransform) -> View:
        """The viewpoint, or one a little nearer or further, to which the camera that searches can be brought.

        Raises PlanningError when there is none.
        """
        finite_pose("the camera's pose", world_from_camera)
        return self._first_view([world_from_camera])

    def view_of(self, place: FloatArray, world_from_camera: RigidTransform) -> View:
        """A view of a `place` (3,) m that was glimpsed from a camera. Raises PlanningError when there is none."""
        vector("the place", place)
        finite_pose("the camera's pose", world_from_camera)
        return self._first_view(views_of(place, world_from_camera, self.parameters.viewing.spiral.distance))

    @counts_as("planning")
    def best_view(
        self, world_from_connector: RigidTransform, taken: Sequence[FloatArray] = (), past: str | None = None
    ) -> View:
        """The best viewpoint that shows the whole connector, from another side than the lines of sight `taken` (3,).

        Where an arm holds it, both its ends show `past` that. One whose line of sight leads through unseen space is
        taken only where there is no other.

        Raises PlanningError when there is none.
        """
        finite_pose("the connector's pose", world_from_connector)
        viewing = self.parameters.viewing
        points = outline(world_from_connector, self.known.cable.connector.length)[:: 1 if past is None else 2]
        for optimistic in (False, True):
            model = self.model(self.search_arm, optimistic=optimistic)
            for pose in closer_views(world_from_connector, viewing.close_views):
                sight = pose.rotation.apply([0.0, 0.0, 1.0])
                if any(float(sight @ other) > viewing.max_cosine for other in taken):
                    continue
                if self.sees(pose, points, optimistic, past) and len(goals := self._view_goals(pose, model)):
                    return View(pose, goals)
        raise PlanningError(CauseCode.OUT_OF_REACH, "no free place from which the whole connector shows")

    def go_to_view(self, view: View) -> MotionRequest:
        """Bring the camera that searches to a view."""
        return self.move(self.search_arm, view.joints, margin=self.parameters.viewing.margin, tight=False)

    @counts_as("planning")
    def _first_view(self, views: Sequence[RigidTransform]) -> View:
        for optimistic in (False, True):
            model = self.model(self.search_arm, optimistic=optimistic)
            for pose in approached(views, self.parameters.viewing.approaches):
                goals = self._view_goals(pose, model)
                if len(goals):
                    return View(pose, goals)
        raise PlanningError(CauseCode.OUT_OF_REACH, "no free place to look from")

    def _view_goals(self, world_from_camera: RigidTransform, model: CollisionModel) -> FloatArray:
        """Joints (k, n) of the search arm that bring its camera there and are free in its `model`."""
        mount, margin = self.known.search_mount, self.parameters.viewing.margin
        views = ik_view(self.kinematics[self.search_arm], world_from_camera, mount.mount_from_camera)
        return np.array([q for q in views if model.free(q, margin)]).reshape(-1, len(self.kinematics[self.search_arm]))
