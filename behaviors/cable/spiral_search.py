"""Look behind things with the wrist camera: the thesis's spiral (Hwang 2024, section 3.4.3)."""

from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.behaviors.cable.hand import CAMERA_ARM
from regrasp.behaviors.cable.look import LookLeaf
from regrasp.behaviors.leaf import LeafFailed, LeafPort, LeafSteps
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.cell import FixedMount
from regrasp.motion.failure import PlanningError
from regrasp.motion.planning.viewpoints import Stop, spiral
from regrasp.perception.pose.estimate import Estimate
from regrasp.perception.pose.fusion import fuse

DISTANCE = (
    0.25  # m from the plane through the start: at 0.30 the left arm reaches fewer of the first stops (6 of 9, not 9)
)
ENOUGH = 3  # estimates that make a find
# A stop out of reach or not free is tried nearer (positive) or further along its line of sight, metres.
NEARER = (0.0, 0.05, -0.05, 0.10, -0.10, 0.15)


class SpiralSearch(LookLeaf):
    """Moves the left arm's camera from stop to stop until it sees the connector, at most `time_limit` seconds.

    Starts where the connector was last seen, else, and after a search from there in vain, at the back panel's middle. A
    stop that cannot be reached, not even a little nearer or further, is skipped and logged. Where something shows that
    may be the connector, but too little of it to tell, the camera looks there next. When all is in vain the arm goes
    back to sleep.
    """

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "time_limit": LeafPort(
            data_type=float, required=False, default_value=300.0, above=0, description="s of searching"
        ),
        "look_seconds": LeafPort(
            data_type=float, required=False, default_value=1.0, above=0, description="s of looking from a stop"
        ),
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        clock, belief = self.services.clock, self.services.belief
        begin, skipped, looked = clock.now(), [], 0
        for stop in self._stops():
            trouble = self.services.perception.trouble("wrist")
            if trouble is not None:
                yield from self.go_to_sleep(CAMERA_ARM)
                raise LeafFailed(CauseCode.CAMERA_FAILED, f"{trouble}; the rear camera shows no connector")
            if clock.now() > begin + self.get_input("time_limit"):
                break
            seen: list[Estimate] = []
            glimpses: list[NDArray[np.float64]] = []
            try:
                goals = self._goals([stop.world_from_camera])
                yield from self.go_and_look(goals, self.get_input("look_seconds"), seen, glimpses)
            except PlanningError:
                skipped.append(stop.index)
                continue
            looked += 1
            if len(seen) < ENOUGH <= len(glimpses):
                yield from self._look_there(stop.world_from_camera, np.median(glimpses, axis=0), seen)
            if len(seen) >= ENOUGH:
                found = fuse(seen)
                belief.connector, belief.sure = found.world_from_connector, found.whole
                belief.found_by, belief.vain_searches = "wrist", 0
                position = found.position.round(4).tolist()
                self.say("found", camera="wrist", stop=stop.index, looked=looked, skipped=skipped, position=position)
                return
        belief.vain_searches += 1
        yield from self.go_to_sleep(CAMERA_ARM)
        seconds = clock.now() - begin
        self.say("not found", looked=looked, skipped=skipped)
        raise LeafFailed(
            CauseCode.SEARCH_EXHAUSTED,
            f"not seen from {looked} stops in {seconds:.0f} s; {len(skipped)} stops were out of reach or not free",
        )

    def _stops(self) -> Iterator[Stop]:
        known, last = self.services.known, self.services.perception.track.last
        panel = next(box for box in known.boxes if box.name == "back_panel")
        from_last = last is not None and self.services.belief.vain_searches % 2 == 0
        start = last.position if last is not None and from_last else np.array(panel.center)
        rear = known.camera("rear")
        assert isinstance(rear.mount, FixedMount)
        self.say("search", start=start.round(3).tolist(), last_seen=from_last)
        return spiral(start, rear.mount.world_from_camera, rear.intrinsics, DISTANCE)

    def _look_there(
        self, world_from_camera: RigidTransform, place: NDArray[np.float64], seen: list[Estimate]
    ) -> LeafSteps:
        """Look where something showed that may be the connector: the same way, from before it, else turned."""
        sight = world_from_camera.rotation.apply([0.0, 0.0, 1.0])
        before = RigidTransform.from_components(place - DISTANCE * sight, world_from_camera.rotation)
        turn, _ = Rotation.align_vectors(place - world_from_camera.translation, sight)
        turned = RigidTransform.from_components(world_from_camera.translation, turn * world_from_camera.rotation)
        self.say("glimpsed", position=place.round(3).tolist())
        try:
            goals = self._goals([before, turned])
            yield from self.go_and_look(goals, self.get_input("look_seconds"), seen)
        except PlanningError as error:
            self.say("no closer look", why=str(error))

    def _goals(self, views: Sequence[RigidTransform]) -> NDArray[np.float64]:
        for view, nearer in product(views, NEARER):
            pose = view * RigidTransform.from_translation([0.0, 0.0, nearer])
            goals = self.view_goals(pose)
            if len(goals):
                return goals
        raise PlanningError(CauseCode.OUT_OF_REACH, "no free place to look from")
