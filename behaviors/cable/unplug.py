"""Take the connector out of its socket; where sockets are is known."""

from typing import Any, ClassVar

import numpy as np

from regrasp.behaviors.cable.hand import HANDLING_ARM, HandLeaf
from regrasp.behaviors.leaf import LeafPort, LeafSteps

DRAW_OUT = 0.05  # m along the plug's axis: the plug sits 0.015 deep
SHALLOW = (
    0.008  # m from the pads' middle to the finger tips: they end 12 mm past it, the panel is 20 mm behind the plug
)
CLEAR = 0.06  # m away from the panel then


class Unplug(HandLeaf):
    """Grips the connector in the `socket` of that name, draws it out along its axis, and away from the panel."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "socket": LeafPort(
            data_type=str,
            names="socket",
            description="a socket of the cell; plugged_into: the one that holds the connector at the start",
        )
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        known, motion = self.services.known, self.services.motion
        plug = known.socket(self.get_input("socket")).world_from_plug(known.connector.length)
        yield motion.pick(HANDLING_ARM, plug, shallow=SHALLOW, seen=self.seen)
        yield from self.grip(plug)
        axis = plug.rotation.apply([1.0, 0.0, 0.0])
        yield motion.shift(HANDLING_ARM, -DRAW_OUT * axis, checked=False)
        yield motion.shift(HANDLING_ARM, np.array([-CLEAR, 0.0, 0.0]), checked=False)
