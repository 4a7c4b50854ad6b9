"""After a slip: out of the way, and wait until the cable hangs still."""

from itertools import chain
from typing import Any, ClassVar

from regrasp.behaviors.cable.hand import HAND, HandLeaf
from regrasp.behaviors.leaf import Failed, Port, Steps
from regrasp.interfaces.cause import CauseCode
from regrasp.motion.service import OPEN_GAP
from regrasp.perception.tracking.stillness import Stillness, StillnessParameters

LEAVE_SECONDS = 0.3  # for the end to swing out of the open jaw
STILL = 0.25  # of the mean brightness: a cable that moves by about 1 mm; the jaw forgives 20
BLIND_SECONDS = 15.0  # without the camera: with it, 7 to 13 were waited
FRAME_PERIOD = 0.2  # s between the frames that are compared


class MakeRoom(HandLeaf):
    """Opens the jaw and brings the hand to its sleep pose: it must not hide the connector nor stop its swing.

    First the jaw, then straight back: one that closes may pinch the cable, one that turns away may hook it.
    """

    def steps(self) -> Steps:
        """See the class."""
        self.services.belief.connector = self.services.belief.found_by = None
        self.services.motion.grippers[HAND].open(OPEN_GAP)
        for step in chain(self.wait(LEAVE_SECONDS), self.draw_back(), self.go_to_sleep(HAND)):
            self.services.perception.look("rear")  # the search starts where the end was seen last
            yield step


class WaitUntilStill(HandLeaf):
    """RUNNING while the rear camera sees anything move; FAILURE after `time_limit` seconds.

    A thing that came into the cell meanwhile is mapped then. Without a sound rear camera it waits as long
    as the cable swings at most; without any sound camera FAILURE, for nobody could find the end.
    """

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "time_limit": Port(data_type=float, required=False, default_value=30.0, above=0, description="s of waiting")
    }

    def steps(self) -> Steps:
        """See the class."""
        stillness, begin = Stillness(StillnessParameters(threshold=STILL)), self.services.clock.now()
        limit = self.get_input("time_limit")
        perception = self.services.perception
        while self.services.clock.now() < begin + limit:
            trouble = perception.trouble("rear")
            if trouble is not None:
                yield from self._wait_blind(trouble)
                return
            perception.look("rear")
            frame = perception.frame("rear")
            if frame is not None and frame.stamp >= begin and stillness.feed(frame):
                self.say("still", waited=round(self.services.clock.now() - begin, 2))
                if voxels := perception.map_new_obstacle("rear"):
                    self.say("a new thing stands in the cell", voxels=voxels)
                    self.services.motion.set_obstacles(
                        perception.occupancy.occupied_points(), perception.occupancy.voxel_size
                    )
                return
            yield from self.wait(FRAME_PERIOD)
        raise Failed(CauseCode.NOT_STILL, f"the scene still moved after {limit:.0f} s")

    def _wait_blind(self, trouble: str) -> Steps:
        other = self.services.perception.trouble("wrist")
        if other is not None:
            raise Failed(CauseCode.CAMERA_FAILED, f"{trouble}; {other}")
        self.say("waiting without the rear camera", seconds=BLIND_SECONDS, why=trouble)
        yield from self.wait(BLIND_SECONDS)
