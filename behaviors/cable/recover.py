"""After a slip: move the hand out of the way, and wait until the cable hangs still."""

from dataclasses import dataclass
from itertools import chain
from typing import Any, ClassVar

from regrasp.behaviors.cable.hand import HandLeaf
from regrasp.behaviors.cable.keys import FOUND
from regrasp.behaviors.keys import Keys
from regrasp.behaviors.leaf import LeafFailed, LeafPort, LeafSteps
from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cause import CauseCode


@dataclass(frozen=True)
class MakeRoomParameters:
    """How long the hand waits before it draws back."""

    leave_time: float = 0.3  # s for the end to swing out of the open jaw; choice


@dataclass(frozen=True)
class WaitUntilStillParameters:
    """How often it is looked, and what is done without a camera."""

    blind_time: float = 15.0  # s of waiting without a camera; with one it took 7 to 13 s
    frame_period: float = 0.2  # s between the frames that are compared; choice


class MakeRoom(HandLeaf):
    """Opens the jaw and brings the hand to its sleep pose, so that it neither hides the connector nor stops its swing.

    The jaw opens first, and the hand draws straight back: a jaw that closes may pinch the cable, and a hand that turns
    away may hook it.
    """

    CLEARS: ClassVar[Keys] = (FOUND,)
    parameters: ClassVar[MakeRoomParameters] = MakeRoomParameters()

    def steps(self) -> LeafSteps:
        """See the class."""
        self.clear(FOUND)
        self.services.motion.open_jaw(self.hand)
        to_sleep = self.go_to_sleep(self.hand, pulling=True)
        for step in chain(self.wait(self.parameters.leave_time), self.draw_back(), to_sleep):
            self.services.perception.look(self.overview)  # the search starts where the end was seen last
            yield step


class WaitUntilStill(HandLeaf):
    """RUNNING while the rear camera sees anything move; FAILURE after `time_limit` seconds.

    A thing that came into the cell meanwhile is then mapped. Without a working rear camera it waits the longest
    swing time. Without any working camera it ends in FAILURE: the end could not be found.
    """

    parameters: ClassVar[WaitUntilStillParameters] = WaitUntilStillParameters()

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "time_limit": LeafPort(data_type=float, required=False, default_value=30.0, above=0, description="s of waiting")
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        perception, begin = self.services.perception, self.services.clock.now()
        watch, limit = perception.watch_stillness(self.overview), self.get_input("time_limit")
        while self.services.clock.now() < begin + limit:
            trouble = perception.trouble(self.overview)
            if trouble is not None:
                yield from self._wait_blind(trouble)
                return
            perception.look(self.overview)
            if watch.still():
                self.say("still", waited=round(self.services.clock.now() - begin, 2))
                if voxels := perception.map_new_obstacle(self.overview):
                    self.say("a new thing stands in the cell", voxels=voxels)
                    self.services.take_over_map()
                return
            yield from self.wait(self.parameters.frame_period)
        raise LeafFailed(CableCause.NOT_STILL, f"the scene still moved after {limit:.0f} s")

    def _wait_blind(self, trouble: str) -> LeafSteps:
        other = self.services.perception.trouble(self.search)
        if other is not None:
            raise LeafFailed(CauseCode.CAMERA_FAILED, f"{trouble}; {other}")
        seconds = self.parameters.blind_time
        self.say(f"waiting without the {self.overview} camera", seconds=seconds, why=trouble)
        yield from self.wait(seconds)
