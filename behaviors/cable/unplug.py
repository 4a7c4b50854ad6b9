"""Take the connector out of its socket; where sockets are is known."""

from typing import Any, ClassVar

from regrasp.behaviors.cable.hand import HandLeaf
from regrasp.behaviors.cable.keys import HELD
from regrasp.behaviors.keys import Keys
from regrasp.behaviors.leaf import LeafPort, LeafSteps


class Unplug(HandLeaf):
    """Grips the connector in the `socket` of that name, draws it out along its axis, and away from the panel."""

    WRITES: ClassVar[Keys] = (HELD,)
    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "socket": LeafPort(
            data_type=str,
            names="socket",
            description="a socket of the cell; plugged_into: the one that holds the connector at the start",
        )
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        cable, motion = self.services.known.cable, self.services.motion
        plug = cable.socket(self.get_input("socket")).world_from_plug(cable.connector.length)
        yield motion.pick_plug(plug, point_cloud=self.overview_points)
        yield from self.grip(plug)
        yield motion.pull_out(plug)
