"""Ask the overview camera for the connector before any search."""

from typing import Any, ClassVar

from regrasp.behaviors.cable.hand import CableLeaf
from regrasp.behaviors.cable.keys import FOUND, VAIN_SEARCHES, Found
from regrasp.behaviors.keys import Keys
from regrasp.behaviors.leaf import LeafFailed, LeafPort, LeafSteps
from regrasp.interfaces.cable.cause import CableCause


class CheckCameras(CableLeaf):
    """Looks for `seconds` through the overview camera, then asks the track the thesis's three questions.

    SUCCESS when the connector's frame exists, is fresh and is live; its mean pose is then in the key FOUND. Else
    FAILURE: the connector must be searched for.
    """

    WRITES: ClassVar[Keys] = (
        FOUND,
        VAIN_SEARCHES,
    )
    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "seconds": LeafPort(data_type=float, required=False, default_value=1.5, above=0, description="s of looking")
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        perception = self.services.perception
        looked = yield from self.ask(perception.watch(self.overview, self.get_input("seconds")))
        health = perception.check()
        if not (health.ok and looked.estimates):
            raise LeafFailed(CableCause.CONNECTOR_NOT_FOUND, health.reason)
        found = perception.fuse(looked.estimates)
        self.write(FOUND, Found(found.world_from_connector, found.whole, self.overview))
        self.write(VAIN_SEARCHES, 0)
        self.say("found", camera=self.overview, position=found.position.round(4).tolist())
