"""Search for the connector with the wrist camera: the thesis's spiral (Hwang 2024, section 3.4.3)."""

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from regrasp.behaviors.cable.hand import CAMERA_ARM
from regrasp.behaviors.cable.look import LookLeaf
from regrasp.behaviors.leaf import LeafFailed, LeafPort, LeafSteps
from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cause import CauseCode
from regrasp.motion.failure import PlanningError
from regrasp.motion.planning.viewpoints import SpiralParameters, Viewpoint, spiral
from regrasp.motion.task import MotionTask
from regrasp.perception.pose.estimate import Estimate
from regrasp.perception.pose.fusion import fuse

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform


def _spiral_of_the_left_arm() -> SpiralParameters:
    # At 0.30 m from the plane through the start the left arm reaches only 6 of the first 9 viewpoints; here all 9.
    return SpiralParameters(distance=0.25)


@dataclass(frozen=True)
class SpiralSearchParameters:
    """Where the camera looks from, and when the connector counts as found."""

    spiral: SpiralParameters = field(default_factory=_spiral_of_the_left_arm)
    min_estimates: int = 3  # estimates from one viewpoint that make a find; choice
    # m along the line of sight, positive is nearer: tried in turn where a viewpoint is out of reach or not free; choice
    approaches: tuple[float, ...] = (0.0, 0.05, -0.05, 0.10, -0.10, 0.15)


class SpiralSearch(LookLeaf):
    """Moves the wrist camera from viewpoint to viewpoint until it sees the connector, at most `time_limit` seconds.

    The search starts where the connector was last seen. When that is not known, or a search from there has failed, it
    starts at the back panel's middle. A viewpoint that cannot be reached, not even a little nearer or further, is
    skipped and logged. After a weak detection, too little to tell whether it is the connector, the camera looks there
    next. When the search fails the arm goes back to sleep.
    """

    parameters: ClassVar[SpiralSearchParameters] = SpiralSearchParameters()

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "time_limit": LeafPort(
            data_type=float, required=False, default_value=300.0, above=0, description="s of searching"
        ),
        "look_seconds": LeafPort(
            data_type=float, required=False, default_value=1.0, above=0, description="s of looking from a viewpoint"
        ),
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        clock, begin = self.services.clock, self.services.clock.now()
        skipped: list[int] = []
        looked = 0
        for viewpoint in self._viewpoints():
            yield from self._check_camera()
            if clock.now() > begin + self.get_input("time_limit"):
                break
            try:
                seen = yield from self._look_from(viewpoint.world_from_camera)
            except PlanningError:
                skipped.append(viewpoint.index)
                continue
            looked += 1
            if len(seen) >= self.parameters.min_estimates:
                position = self._believe(fuse(seen))
                stop = viewpoint.index
                self.say("found", camera="wrist", stop=stop, looked=looked, skipped=skipped, position=position)
                return
        self.services.belief.vain_searches += 1
        yield from self.go_to_sleep(CAMERA_ARM)
        seconds = clock.now() - begin
        self.say("not found", looked=looked, skipped=skipped)
        raise LeafFailed(
            CableCause.SEARCH_EXHAUSTED,
            f"not seen from {looked} stops in {seconds:.0f} s; {len(skipped)} stops were out of reach or not free",
        )

    def _check_camera(self) -> LeafSteps:
        """Steps that bring the arm to sleep and fail when the wrist camera is not to be trusted."""
        trouble = self.services.perception.trouble("wrist")
        if trouble is not None:
            yield from self.go_to_sleep(CAMERA_ARM)
            raise LeafFailed(CauseCode.CAMERA_FAILED, f"{trouble}; the rear camera shows no connector")

    def _look_from(self, world_from_camera: "RigidTransform") -> Generator[MotionTask | None, None, list[Estimate]]:
        """Estimates from a viewpoint, and from nearer after a weak detection. Raises PlanningError out of reach."""
        seen: list[Estimate] = []
        weak_detections: list[NDArray[np.float64]] = []
        goals = self._goals([world_from_camera])
        yield from self.go_and_look(goals, self.get_input("look_seconds"), seen, weak_detections)
        if len(seen) < self.parameters.min_estimates <= len(weak_detections):
            yield from self._look_there(world_from_camera, np.median(weak_detections, axis=0), seen)
        return seen

    def _believe(self, found: Estimate) -> list[float]:
        """Take the found connector into the belief; its position (m in the world) for the log."""
        belief = self.services.belief
        belief.connector, belief.sure = found.world_from_connector, found.whole
        belief.found_by, belief.vain_searches = "wrist", 0
        position: list[float] = found.position.round(4).tolist()
        return position

    def _viewpoints(self) -> Iterator[Viewpoint]:
        from regrasp.interfaces.cell import FixedMount

        known, last = self.services.known, self.services.perception.track.last
        panel = next(box for box in known.boxes if box.name == "back_panel")
        from_last = last is not None and self.services.belief.vain_searches % 2 == 0
        start = last.position if last is not None and from_last else np.array(panel.center)
        rear = known.camera("rear")
        assert isinstance(rear.mount, FixedMount)
        self.say("search", start=start.round(3).tolist(), last_seen=from_last)
        return spiral(start, rear.mount.world_from_camera, rear.intrinsics, self.parameters.spiral)

    def _look_there(
        self, world_from_camera: "RigidTransform", place: NDArray[np.float64], seen: list[Estimate]
    ) -> LeafSteps:
        """Look at a weak detection at `place` (3,) m: from in front of it in the same direction, else turned to it."""
        from scipy.spatial.transform import RigidTransform, Rotation

        sight = world_from_camera.rotation.apply([0.0, 0.0, 1.0])
        position = place - self.parameters.spiral.distance * sight
        before = RigidTransform.from_components(position, world_from_camera.rotation)
        turn, _ = Rotation.align_vectors(place - world_from_camera.translation, sight)
        turned = RigidTransform.from_components(world_from_camera.translation, turn * world_from_camera.rotation)
        self.say("glimpsed", position=place.round(3).tolist())
        try:
            goals = self._goals([before, turned])
            yield from self.go_and_look(goals, self.get_input("look_seconds"), seen)
        except PlanningError as error:
            self.say("no closer look", why=str(error))

    def _goals(self, views: "Sequence[RigidTransform]") -> NDArray[np.float64]:
        """Joints (n, 6) rad for the first view that can be reached. Raises PlanningError when there is none."""
        from scipy.spatial.transform import RigidTransform

        model = self.services.motion.model(CAMERA_ARM)
        for view, approach in product(views, self.parameters.approaches):
            pose = view * RigidTransform.from_translation([0.0, 0.0, approach])
            goals = self.view_goals(pose, model)
            if len(goals):
                return goals
        raise PlanningError(CauseCode.OUT_OF_REACH, "no free place to look from")
