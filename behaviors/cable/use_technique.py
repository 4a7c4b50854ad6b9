"""Choose how the robot finds the connector."""

from typing import Any, ClassVar

from py_trees.common import Status

from regrasp.behaviors.cable.services import CableServices
from regrasp.behaviors.leaf import Leaf, LeafPort


class UseTechnique(Leaf):
    """Makes every look from now on use this technique of `regrasp.perception.pose.technique`; always SUCCESS."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "technique": LeafPort(
            data_type=str,
            names="technique",
            description="rgbd, detector, fused; fiducial where the connector has a tag",
        )
    }
    OUTPUT_PORTS: ClassVar[dict[str, Any]] = {}
    RETURNS = frozenset({Status.SUCCESS})
    services: CableServices

    def work(self) -> Status:
        """See the class."""
        name = self.get_input("technique")
        self.services.perception.use(name)
        self.say("looks from now on", technique=name)
        return Status.SUCCESS
