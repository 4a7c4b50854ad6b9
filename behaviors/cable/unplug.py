"""Take the connector out of its socket; where sockets are is known."""

from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

from regrasp.behaviors.cable.hand import HandLeaf
from regrasp.behaviors.cable.keys import HELD, VAIN_CARRIES
from regrasp.behaviors.keys import Keys
from regrasp.behaviors.leaf import LeafPort, LeafSteps
from regrasp.motion.failure import GraspEmptyError, TouchError


@dataclass(frozen=True)
class UnplugParameters:
    """How often the hand tries."""

    tries: int = 3  # choice


class Unplug(HandLeaf):
    """Grips the connector in the `socket` of that name, draws it out along its axis, and goes back the way it came in.

    A hand that closes on nothing, or touches something each time, tries again, with another grasp where there is one.
    Every other try goes by the encoders alone: where things stand beside the arm, what a camera sees of it misleads.
    Where the cell's hand finds no way, another arm tries.
    """

    WRITES: ClassVar[Keys] = (HELD, VAIN_CARRIES)
    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "socket": LeafPort(
            data_type=str,
            names="socket",
            description="a socket of the cell; plugged_into: the one that holds the connector at the start",
        )
    }

    parameters: ClassVar[UnplugParameters] = UnplugParameters()

    def steps(self) -> LeafSteps:
        """See the class."""
        cable, motion = self.services.known.cable, self.services.motion
        plug = cable.socket(self.get_input("socket")).world_from_plug(cable.connector.length)
        arms = sorted((arm.name for arm in self.services.known.arms), key=lambda name: name != cable.hand)
        for left in range(self.parameters.tries - 1, -1, -1):
            try:
                by_sight = (self.parameters.tries - left) % 2 == 1
                points = self.overview_points if by_sight else None
                yield from self.take(arms, partial(motion.pick_plug, plug, point_cloud=points))
                yield from self.grip_or_leave(plug)
                break
            except (GraspEmptyError, TouchError) as error:
                if not left:
                    raise
                self.say("tries again", why=str(error))
        yield motion.pull_out(plug)
