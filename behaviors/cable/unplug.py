"""Take the connector out of its socket; where sockets are is known."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from regrasp.behaviors.cable.hand import HANDLING_ARM, HandLeaf
from regrasp.behaviors.leaf import LeafPort, LeafSteps


@dataclass(frozen=True)
class UnplugParameters:
    """How the plug is gripped and drawn out."""

    draw_out: float = 0.05  # m along the plug's axis; the plug sits 0.015 m deep
    # m by which the plug lies nearer to the finger tips than the pads' middle: they end 12 mm past it, and the panel is
    # 20 mm behind the plug
    shallow: float = 0.008
    retreat: float = 0.06  # m away from the panel then; choice


class Unplug(HandLeaf):
    """Grips the connector in the `socket` of that name, draws it out along its axis, and away from the panel."""

    parameters: ClassVar[UnplugParameters] = UnplugParameters()
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
        plug = known.cable.socket(self.get_input("socket")).world_from_plug(known.cable.connector.length)
        yield motion.pick(HANDLING_ARM, plug, shallow=self.parameters.shallow, point_cloud=self.rear_point_cloud)
        yield from self.grip(plug)
        axis = plug.rotation.apply([1.0, 0.0, 0.0])
        yield motion.shift(HANDLING_ARM, -self.parameters.draw_out * axis, checked=False)
        yield motion.shift(HANDLING_ARM, np.array([-self.parameters.retreat, 0.0, 0.0]), checked=False)
