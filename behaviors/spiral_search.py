"""Look behind things with the wrist camera: the thesis's spiral (Hwang 2024, section 3.4.3)."""

from typing import Any, ClassVar

import numpy as np
from py_trees.ports import PortInformation

from behaviors.hand import EYE, HandLeaf, mean_pose
from behaviors.leaf import Failed, Steps
from interfaces.cause import CauseCode
from interfaces.cell import FixedMount, WristMount
from motion.failure import PlanningError
from motion.service import MARGIN
from motion.viewpoints import Stop, spiral
from perception.rgbd_pose import Estimate

ENOUGH = 3  # estimates that make a find


class SpiralSearch(HandLeaf):
    """Moves the left arm's camera from stop to stop until it sees the connector, at most `time_limit` seconds.

    Starts where the connector was last seen, else at the back panel's middle. A stop that cannot be reached is skipped
    and logged. Afterwards the arm goes back to sleep, so that the hand has room.
    """

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "time_limit": PortInformation(data_type=float, required=False, default_value=300.0),
        "look_seconds": PortInformation(data_type=float, required=False, default_value=1.0),
    }

    def steps(self) -> Steps:
        """See the class."""
        clock, belief = self.services.clock, self.services.belief
        begin, looked = clock.now(), 0
        for stop in self._stops():
            if clock.now() > begin + self.get_input("time_limit"):
                break
            goals = self._goals(stop)
            if not len(goals):
                self.say("stop skipped", stop=stop.index, why="out of reach or not free")
                continue
            try:
                yield from self._go(goals)
            except PlanningError as error:
                self.say("stop skipped", stop=stop.index, why=str(error))
                continue
            looked += 1
            seen: list[Estimate] = []
            yield from self._look(seen)
            if len(seen) >= ENOUGH:
                belief.connector, belief.found_by = mean_pose(seen), "wrist"
                position = belief.connector.translation.round(4).tolist()
                self.say("found", camera="wrist", stop=stop.index, stops=looked, position=position)
                yield from self.go_to_sleep(EYE)
                return
        yield from self.go_to_sleep(EYE)
        seconds = clock.now() - begin
        raise Failed(CauseCode.SEARCH_EXHAUSTED, f"not seen from {looked} stops in {seconds:.0f} s")

    def _stops(self) -> Any:
        known, last = self.services.known, self.services.perception.track.last
        panel = next(box for box in known.boxes if box.name == "back_panel")
        start = np.array(panel.center) if last is None else last.position
        rear = known.camera("rear")
        assert isinstance(rear.mount, FixedMount)
        self.say("search", start=start.round(3).tolist(), last_seen=last is not None)
        return spiral(start, rear.mount.world_from_camera, rear.intrinsics)

    def _goals(self, stop: Stop) -> np.ndarray:
        motion = self.services.motion
        mount = self.services.known.camera("wrist").mount
        assert isinstance(mount, WristMount)
        model = motion.model(EYE)
        views = motion.kinematics[EYE].ik_view(stop.world_from_camera, mount.wrist_from_camera)
        return np.array([q for q in views if model.free(q, MARGIN)]).reshape(-1, 6)

    def _go(self, goals: np.ndarray) -> Steps:
        """Like yielding the task, but a motion that cannot be is the caller's to handle."""
        task = self.services.motion.move(EYE, goals)
        while not task.poll():
            yield None

    def _look(self, seen: list[Estimate]) -> Steps:
        """Look for a while; the frame also shows what stands there."""
        clock, perception, motion = self.services.clock, self.services.perception, self.services.motion
        begin = clock.now()
        mapped = False
        stamps: set[float] = set()
        while clock.now() < begin + self.get_input("look_seconds") - 1e-9:
            yield None
            result = perception.look("wrist")
            if result is None or result.stamp < begin:
                continue
            if not mapped:
                perception.map_obstacles("wrist")
                motion.set_obstacles(perception.occupancy.occupied_points(), perception.occupancy.h)
                mapped = True
            if isinstance(result, Estimate) and result.stamp not in stamps:
                stamps.add(result.stamp)
                seen.append(result)
